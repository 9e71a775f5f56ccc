// PNG in memory: encodes 8-bit sRGB, decodes any ordinary PNG.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill {

/// The bytes of an 8-bit RGB PNG marked as sRGB. `rgb` is interleaved, rows from the top, width·height·3 bytes. Equal
/// pixels give equal files.
Result<std::string> encode_png(int width, int height, std::span<const std::uint8_t> rgb);

/// Linear pixels of a PNG, whose values are taken as sRGB. Alpha is ignored. Malicious bytes give INVALID_ARGUMENT.
Result<RgbImage> decode_png(ByteView bytes);

}  // namespace lightmill
