// A check of a scene's images before anything is sent.
#pragma once

#include "client/cli/signals.h"
#include "common/base/status.h"
#include "common/image/decoder/decoder_process.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// Decodes each image of the scene as a worker does, with the same program. Adds notices about what is used otherwise
/// than the file says. Fails for an image that cannot be rendered, and names its place. Without images it does nothing.
Status check_images(const DecoderOptions& decoder, LoadedScene& loaded, const Signals& signals);

}  // namespace lightmill::cli
