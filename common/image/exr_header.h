// End of an EXR file's header, found without OpenEXR. OpenEXR allocates whatever size an attribute states, up to 2 GiB,
// before it reads the header.
#pragma once

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// Checks the first bytes.
bool is_exr(ByteView bytes);

/// Number of bytes before the line offset table. INVALID_ARGUMENT if the file is no EXR, or if an attribute of a header
/// exceeds the file.
Result<std::size_t> exr_header_end(ByteView bytes);

}  // namespace lightmill
