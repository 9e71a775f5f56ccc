// Fingerprint of the decoder's libraries: programs with the same one decode images and meshes to the same bits.
#pragma once

#include <string>

#include "common/base/status.h"

namespace lightmill {

/// A hash of the versions of OpenImageIO, of the libraries that it reads our formats with, and of Draco, and of the pixels
/// of a built-in JPEG picture and the arrays of a built-in mesh. JPEG is the format whose decoders may differ in the last
/// bits. The readers must be prepared.
Result<std::string> decoder_fingerprint();

}  // namespace lightmill
