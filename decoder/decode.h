// Decoding as a decoder's child does it.
#pragma once

#include "decoder/confined_child.h"

namespace lightmill {

/// What a child may take for such a request.
ChildLimits limits_for(const DecodeRequest& request);

/// Reads the image whose bytes are in `file`, and writes its pixels to the empty file `room` unless only its size is
/// asked for.
DecodeReply decode(const DecodeRequest& request, int file, int room);

}  // namespace lightmill
