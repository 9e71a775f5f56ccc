// Image reader with OpenImageIO in this process, for the image decoder and tests.
//
// OpenImageIO is large, starts slowly and has had many faults. Programs of the farm do not link it. They use a
// DecoderProcess (image/decoder), which runs the same code in a sandbox.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image_size.h"
#include "common/image/texels.h"

namespace lightmill {

/// Decodes the bytes of an image file. `name` is only for messages. Files with 8 bits per channel give bytes, others
/// floats. 8- and 16-bit integers count as encoded, floats as linear. Colours are not multiplied by alpha. What
/// headers say about pixels is applied (OpenedImage). Of several images or mip levels, the first is read. Fails for
/// files that are no image, for more than `max_pixels` and for values that are not finite. The message begins with the
/// name.
Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels);
inline Result<Texels> read_image(ByteView bytes, const std::string& name) {
  return read_image_within(bytes, name, kMaxTexturePixels);
}

/// Size of the image, without decoding it. Fails for files that are no image.
Result<ImageSize> read_size(ByteView bytes, const std::string& name);

}  // namespace lightmill
