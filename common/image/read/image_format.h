// Format of an image file, detected by its first bytes.
#pragma once

#include <string>

#include "common/base/digest.h"

namespace lightmill {

/// The supported formats, for messages. OpenImageIO's readers of these take bytes from memory.
inline constexpr const char* kImageFormats =
    "PNG, JPEG, OpenEXR, Radiance HDR, TIFF, TGA, BMP, GIF, WebP, PNM, PFM, PSD and DDS";

/// OpenImageIO's name of the reader; empty if `bytes` begin like none of kImageFormats.
std::string image_format(ByteView bytes);

}  // namespace lightmill
