// Pictures of the difference from a reference.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill::lab {

/// A PNG that is red where the picture is too bright, and blue where it is too dark. The value is (x − r)/(|r| + 0.1)
/// of the channels' mean. It is full at a quarter, and black where equal. The pictures have one size.
Result<std::string> difference_png(const RgbImage& picture, const RgbImage& reference);

/// The picture itself as a PNG.
Result<std::string> picture_png(const RgbImage& picture);

}  // namespace lightmill::lab
