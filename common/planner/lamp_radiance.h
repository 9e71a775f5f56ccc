// How bright a scene's lamps are.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// The radiance of all that next-event estimation samples and that has an extent, by channel: the mean over what
/// arrives, without occlusion, at some points between the eye and the middle of the scene. 0 where there is no such
/// light.
Vec3 lamp_radiance(const CompiledScene& scene);

}  // namespace lightmill
