// Notices of surprises in a picture that can be predicted from its scene.
#pragma once

#include "common/image/image_size.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Notices, if:
/// - nothing emits light. Only with `needs_light`: the method needs lights.
/// - the camera sees no object, or all objects together fill only a few pixels. Not with a plane or an environment,
///   because the picture may be meant to show that.
/// - a sphere is too large for what is near it
/// - a medium scatters so densely that paths of `max_bounces` end inside (0: the method follows no paths)
std::vector<std::string> picture_notices(const LoadedScene& loaded, bool needs_light, std::uint32_t max_bounces = 0);

/// Checks the size of an image that is an environment. Notices: such an image that is not twice as wide as high, and
/// properties of any image that are ignored.
Status check_image_header(const ImageAsset& image, const ImageSize& size, std::vector<std::string>& notices);

}  // namespace lightmill
