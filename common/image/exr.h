// OpenEXR in memory: lossless encoding, and decoding of ordinary scan-line and tiled files.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill {

/// The bytes of an EXR file (ZIP compression, Rec. 709 chromaticities). Every channel must have one value per pixel of
/// `data`. Equal images give equal bytes.
Result<std::string> encode_exr(const Image& image);

/// The inverse: all channels (half floats are widened), primaries, and text and number attributes. Malicious bytes give
/// INVALID_ARGUMENT, never a crash.
Result<Image> decode_exr(ByteView bytes);

/// DATA_LOSS unless `bytes`, which were decoded to `image`, have the form of encode_exr: the same header byte for byte,
/// then the chunks of lines in order, and nothing else. Compressed data is not compared.
Status check_exr_form(ByteView bytes, Image image);

// ---- header checks without OpenEXR, because OpenEXR allocates the size that an attribute states, up to 2 GiB ----

/// Checks the first bytes.
bool is_exr(ByteView bytes);

/// Number of bytes before the line offset table. INVALID_ARGUMENT if the file is no EXR, or if an attribute of a header
/// exceeds the file.
Result<std::size_t> exr_header_end(ByteView bytes);

}  // namespace lightmill
