// Parts of a scene that mesh files do not have: a camera and light.
#pragma once

#include "common/scene/compiled/world_frame.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// A camera that sees a box from the front, the right and above. The box's bounding sphere fills the view.
Camera camera_for(const Bounds& box);

/// Gives the scene such a camera of all its objects. INVALID_ARGUMENT if it has only planes.
Status use_automatic_camera(LoadedScene& loaded);

/// Adds a uniform white sky of radiance 1.
void add_sky(LoadedScene& loaded);

/// Gives the scene of files without a camera the automatic one, or the view into the course's Cornell box if its bounds
/// are that box. Another view than this is a notice.
void add_missing_camera(LoadedScene& loaded);

/// Adds a sky, with a notice, unless something lights the scene (is_lit). The course's Cornell box only needs to emit.
void add_missing_light(LoadedScene& loaded);

}  // namespace lightmill
