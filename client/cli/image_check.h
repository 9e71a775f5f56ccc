// Whether a scene's images can be used, asked before anything is sent.
#pragma once

#include <filesystem>

#include "client/cli/signals.h"
#include "common/base/status.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {

/// Decodes each image of the scene as a worker will, by the library of that name beside our program
/// (images/inspect_image.h). Adds notices of what counts otherwise than the file says; fails for what cannot be
/// rendered, with the place that names the image. Does nothing if there are no images.
Status check_images(const std::filesystem::path& library, LoadedScene& loaded, const Signals& signals);

/// The library that belongs to this program.
std::filesystem::path image_library();

}  // namespace lightmill::cli
