// What of a picture can be foreseen from its scene, and would surprise whoever waits for it.
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

/// Whether any light or material of an object does.
bool emits_light(const Scene& scene);

/// Says that nothing emits light (if `needs_light`: the method shows what lights show), and that the camera sees no
/// object, or all of them together as a mere dot. The latter is not said where a plane or an environment is, which may
/// well be what is to be seen. And which sphere is too large for what is near it, and which media scatter so densely
/// that paths of `max_bounces` end within them (0: the method follows none).
std::vector<std::string> picture_notices(const LoadedScene& loaded, bool needs_light, std::uint32_t max_bounces = 0);

}  // namespace lightmill
