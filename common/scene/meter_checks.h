// The checks of a scene's virtual meters; part of validate(Scene).
#pragma once

#include <vector>

#include "common/scene/document.h"

namespace lightmill {

Status validate_meters(const std::vector<Meter>& meters);

}  // namespace lightmill
