// `preview`: the reflectance and the emission of what the camera sees first, without any light transport.
#pragma once

#include <memory>

#include "common/methods/method.h"

namespace lightmill {

std::unique_ptr<Method> make_preview_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings);

}  // namespace lightmill
