// Emitters of a Mitsuba scene that are not surfaces.
#pragma once

#include "common/scene_io/mitsuba/mitsuba_textures.h"
#include "common/scene_io/notices.h"

namespace lightmill {

/// From the file's world to the scene. The images of a scene's environments have +y above. So the scene is turned if
/// the file turns its environment in another way than about y. Errors are noted at the emitters.
Transform mitsuba_world_to_scene(const std::vector<const MitsubaObject*>& emitters, Notices& notices);

/// A point, spot, directional, constant or envmap emitter.
Result<Light> read_mitsuba_light(const MitsubaObject& from, const Transform& world_to_scene, MitsubaTextures& textures,
                                 FileSource& files, LoadedScene& loaded, Notices& notices);

}  // namespace lightmill
