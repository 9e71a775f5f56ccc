// `raycast`: the light of all lights that the surface seen first scatters (local_shading.h), and what it emits.
//
// No light goes on from there: mirrors and smooth glass are black. Nothing is random but the position in the pixel (and
// on the lens).
#pragma once

#include <memory>

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {

std::unique_ptr<Method> make_raycast_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                            const MethodSpec& spec);

}  // namespace lightmill
