// Radiance of a scene's lights as seen in the casters of caustics.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Mean radiance, by channel, of the sampled lights as casters show them. It is weighted by the light that arrives at
/// the casters. Occlusion and the losses of casters are ignored. A smooth caster shows a light at its full radiance. A
/// light without extent adds 0, because paths from the camera cannot hit it. A rough caster blurs the light over its
/// lobe. Casters are weighted by size. 0 without casters or lights.
Vec3 emitter_radiance_in_casters(const CompiledScene& scene);

}  // namespace lightmill
