// The camera as OpenEXR's standard attributes have it.
#pragma once

#include "common/image/image.h"
#include "common/scene/document.h"

namespace lightmill {

/// For points as rows, (x, y, z, 1) · M, of the scene's frame.
struct CameraMatrices {
  /// To x right, y up and z ahead of the eye, in scene units.
  ImageMatrix world_to_camera;
  /// To (0, 0) at the upper left and (1, 1) at the lower right of the whole picture, after division by the fourth
  /// value; the third one means nothing but that it grows with the distance.
  ImageMatrix world_to_ndc;
};

/// The camera must be valid, for a picture of `width` to `height`.
CameraMatrices camera_matrices(const Camera& camera, double width, double height);

}  // namespace lightmill
