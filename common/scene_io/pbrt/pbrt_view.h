// Camera, film and pixel filter of a pbrt scene.
#pragma once

#include "common/scene_io/notices.h"
#include "common/scene_io/pbrt/pbrt_parameters.h"

namespace lightmill {

/// A directive with a type, such as Camera "perspective".
struct PbrtEntity {
  std::string type;
  PbrtParameters parameters;
};

/// The directives before WorldBegin. Without a directive, pbrt's defaults apply.
struct PbrtOptions {
  std::optional<PbrtEntity> camera, film, filter;
  Transform camera_from_world = kIdentityTransform;  ///< at the Camera directive
};

struct PbrtView {
  Camera camera;
  FilmSettings film;
  /// From the file's world to the scene. pbrt's cameras mirror: x grows to the right of one that looks along +z with +y
  /// up. A scene document's cameras do not. So the scene is mirrored instead, unless the file mirrors the camera.
  Transform world_to_scene = kIdentityTransform;
  double exposure = 1;  ///< factor of all light: seconds the shutter is open · iso / 100
};

/// `end` is the place of WorldBegin, for errors of defaults.
Result<PbrtView> read_pbrt_view(const PbrtOptions& options, const SourcePlace& end, Notices& notices, Faults& faults);

}  // namespace lightmill
