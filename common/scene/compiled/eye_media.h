// Which media a point is in.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Follows a ray from a point in the frame out of the scene: the shapes that it leaves before it has entered them are
/// around the point. The scene's geometry and media must be ready.
Media8 find_media(const CompiledScene& scene, const Vec3& point, const Vec3& direction);

}  // namespace lightmill
