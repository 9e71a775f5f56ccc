// Image reader like DecoderProcess, with OpenImageIO in this process.
#pragma once

#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image_size.h"
#include "common/image/texels.h"

namespace lightmill {

/// Result as of DecoderProcess::decode.
Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels);
inline Result<Texels> read_image(ByteView bytes, const std::string& name) {
  return read_image_within(bytes, name, kMaxTexturePixels);
}

/// The values of all channels, not decoded, four per pixel.
std::vector<float> values_of(const Texels& texels);

/// Size of the image, without decoding it. Fails for files that are no image.
Result<ImageSize> read_size(ByteView bytes, const std::string& name);

}  // namespace lightmill
