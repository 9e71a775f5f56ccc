// How bright a scene's lamps are, as what casts caustics shows them.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// The radiance, by channel, of all that next-event estimation samples as seen in the casters of caustics from where
/// they send it: the mean over what arrives there, without occlusion and without what the casters take. A smooth one
/// shows a lamp as bright as it is, and one without extent never (0: paths from the camera do not meet it); a rough one
/// blurs it over its lobe. Large casters count by their size. 0 where there are no casters, or no such light.
Vec3 shown_lamp_radiance(const CompiledScene& scene);

}  // namespace lightmill
