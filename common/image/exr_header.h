// Where the header of an EXR file ends, told without OpenEXR: before it reads a header it makes room for whatever an
// attribute says its size is, up to 2 GiB.
#pragma once

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// By its first bytes.
bool is_exr(ByteView bytes);

/// How many bytes come before the table of lines. INVALID_ARGUMENT unless each attribute of the headers lies within the
/// file, and for what is no EXR file.
Result<std::size_t> exr_header_end(ByteView bytes);

}  // namespace lightmill
