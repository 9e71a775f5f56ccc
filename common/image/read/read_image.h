// Reading image files by OpenImageIO, and nothing else of it: the only folder that includes it. What links this starts
// slowly (some 0.3 s), so only the worker does.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/texels.h"

namespace lightmill {

/// Decodes the bytes of an image file; `name` is the file's name, whose ending tells the format. Files of 8 bits a
/// channel give bytes, others floats; 8- and 16-bit integers are taken as encoded, floats as linear. Colours are those
/// of the file: they are not multiplied by alpha. Of several images or mip levels the first counts. Fails for what is
/// no image, for more than `max_pixels` and for values that are not finite, with a message that begins with the name.
Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels);
inline Result<Texels> read_image(ByteView bytes, const std::string& name) {
  return read_image_within(bytes, name, kMaxTexturePixels);
}

}  // namespace lightmill
