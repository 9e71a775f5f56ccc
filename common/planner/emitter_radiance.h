// Radiance of a scene's lights as seen in the casters of caustics.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Radiance, by channel, of all sampled lights as seen in casters, from where the casters send it. It is the mean over
/// the arriving light, without occlusion and without the casters' losses. A smooth caster shows a light at its full
/// radiance. It never shows a light without extent, which counts 0, because paths from the camera cannot hit it. A
/// rough caster blurs the light over its lobe. Casters count by size. 0 without casters or lights.
Vec3 emitter_radiance_in_casters(const CompiledScene& scene);

}  // namespace lightmill
