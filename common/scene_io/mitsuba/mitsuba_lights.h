// Emitters of a Mitsuba scene that are not surfaces.
#pragma once

#include "common/scene_io/mitsuba/mitsuba_textures.h"
#include "common/scene_io/notices.h"

namespace lightmill {

/// A point, spot, directional, constant or envmap emitter.
Result<Light> read_mitsuba_light(const MitsubaObject& from, MitsubaTextures& textures, FileSource& files,
                                 LoadedScene& loaded, Notices& notices);

}  // namespace lightmill
