// Whether a scene's images can be used, asked before anything is sent.
#pragma once

#include "client/cli/signals.h"
#include "common/base/status.h"
#include "common/image/decoder/decoder_process.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// Decodes each image of the scene as a worker does, by the same program. Adds notices of what counts otherwise than
/// the file says. Fails for what cannot be rendered, with the place that names the image. Does nothing if there are no
/// images.
Status check_images(const DecoderOptions& decoder, LoadedScene& loaded, const Signals& signals);

}  // namespace lightmill::cli
