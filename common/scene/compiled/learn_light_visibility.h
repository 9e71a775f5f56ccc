// Learns how much of the light of a scene's groups of lights arrives where paths go.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Shadow rays from the vertices of paths that start at the camera, half of them at meters if there are any, and scatter
/// like white diffuse surfaces. Their number is fixed, and so are the random numbers, so the result depends only on the scene. Empty if it would reduce the
/// second moment of the choice of lights by less than a third.
LightVisibility learn_light_visibility(const CompiledScene& scene);

}  // namespace lightmill
