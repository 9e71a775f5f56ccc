// OpenEXR in memory: encoding with lossless compression, and decoding of ordinary scan-line and tiled files.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill {

/// The bytes of an EXR file (ZIP compression, Rec. 709 chromaticities). Every channel has as many values as `data` has
/// pixels. The same image gives the same bytes.
Result<std::string> encode_exr(const Image& image);

/// The inverse: all channels (half floats are widened) and the text and number attributes. Hostile bytes give
/// INVALID_ARGUMENT, never a crash.
Result<Image> decode_exr(ByteView bytes);

/// DATA_LOSS unless `bytes`, which were decoded to `image`, have the form that encode_exr gives it: the same header,
/// byte for byte, then the lines' chunks in order, and nothing between or after them. What is compressed is not looked
/// at.
Status check_exr_form(ByteView bytes, Image image);

}  // namespace lightmill
