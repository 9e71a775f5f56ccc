// Which media the eye is in.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Follows a ray from the eye out of the scene: the shapes that it leaves before it has entered them are around the
/// eye. The scene's geometry, media and camera must be ready.
Media8 find_eye_media(const CompiledScene& scene);

}  // namespace lightmill
