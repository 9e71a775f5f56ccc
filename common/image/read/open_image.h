// Which of OpenImageIO's readers a picture from elsewhere is given to: one, chosen by how it begins.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// Opens `bytes` by the reader of the format that they begin like; where that tells nothing, of the one that `name`
/// ends with. No other reader sees them: what is damaged is refused by the one that it was made for. `source` reads
/// `bytes` and outlives the result. INVALID_ARGUMENT, beginning with `name`.
Result<std::unique_ptr<OIIO::ImageInput>> open_image(ByteView bytes, const std::string& name,
                                                     OIIO::Filesystem::IOProxy& source, OIIO::ImageSpec config = {});

}  // namespace lightmill
