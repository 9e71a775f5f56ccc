// The camera as OpenEXR's standard attributes.
#pragma once

#include "common/image/image.h"
#include "common/scene/document.h"

namespace lightmill {

/// For row vectors, (x, y, z, 1) · M, of the scene's frame.
struct CameraMatrices {
  /// To x right, y up and z ahead of the camera, in scene units.
  ImageMatrix world_to_camera;
  /// To (0, 0) at the upper left and (1, 1) at the lower right of the whole picture, after division by the fourth
  /// value. The third value grows with the distance and has no other meaning.
  ImageMatrix world_to_ndc;
};

/// The camera must be valid. The picture has the aspect `width` to `height`.
CameraMatrices camera_matrices(const Camera& camera, double width, double height);

}  // namespace lightmill
