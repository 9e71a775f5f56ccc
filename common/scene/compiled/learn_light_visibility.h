// Learns how much of the light of a scene's groups of lights arrives where paths go.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Traces shadow rays from the vertices of paths that scatter like white diffuse surfaces. They start at the camera, and
/// half of them at meters if there are any. Counts and random numbers are fixed, so the result depends only on the scene.
/// Empty unless it would reduce the second moment of the choice of lights by a third.
LightVisibility learn_light_visibility(const CompiledScene& scene);

}  // namespace lightmill
