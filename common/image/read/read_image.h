// Reading image files by OpenImageIO in this process: for what the image decoder and tests read.
//
// OpenImageIO is large, starts slowly and has had many faults. Programs of the farm do not link it: they ask a
// DecoderProcess (image/decoder), where the same code runs in a sandbox.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image_size.h"
#include "common/image/texels.h"

namespace lightmill {

/// Decodes the bytes of an image file; `name` is for messages alone. Files of 8 bits a channel give bytes, others
/// floats; 8- and 16-bit integers are taken as encoded, floats as linear. Colours are those of the file: they are not
/// multiplied by alpha. Of several images or mip levels the first counts. Fails for what is no image, for more than
/// `max_pixels` and for values that are not finite, with a message that begins with the name.
Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels);
inline Result<Texels> read_image(ByteView bytes, const std::string& name) {
  return read_image_within(bytes, name, kMaxTexturePixels);
}

/// How large the image is, without decoding it. Fails for what is no image.
Result<ImageSize> read_size(ByteView bytes, const std::string& name);

}  // namespace lightmill
