// How large an image file is, by OpenImageIO, without decoding it.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image_size.h"

namespace lightmill {

/// `name` as read_image takes it. Fails for what is no image.
Result<ImageSize> read_size(ByteView bytes, const std::string& name);

}  // namespace lightmill
