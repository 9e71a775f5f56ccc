// Decoding of an image or a compressed mesh in the decoder's child.
#pragma once

#include "decoder/confined_child.h"

namespace lightmill {

/// Limits of the child for this request.
ChildLimits limits_for(const DecodeRequest& request);

/// Reads the image or mesh in `file`, and writes its pixels or arrays to the pipe `out`, unless the request is only for an
/// image's size.
DecodeReply decode(const DecodeRequest& request, int file, int out);

}  // namespace lightmill
