// Where a picture is brighter or darker than its reference, to look at.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill::lab {

/// A PNG: red where the picture is too bright and blue where too dark, by (x − r)/(|r| + 0.1) of the channels' mean;
/// full at a quarter, black where equal. The pictures have one size.
Result<std::string> difference_png(const RgbImage& picture, const RgbImage& reference);

/// The picture as a PNG, as it is.
Result<std::string> picture_png(const RgbImage& picture);

}  // namespace lightmill::lab
