// Decoding of an image in the decoder's child.
#pragma once

#include "decoder/confined_child.h"

namespace lightmill {

/// Limits of the child for this request.
ChildLimits limits_for(const DecodeRequest& request);

/// Reads the image in `file`, and writes its pixels to the pipe `pixels`, unless the request is only for the size.
DecodeReply decode(const DecodeRequest& request, int file, int pixels);

}  // namespace lightmill
