// Reader of pbrt-v4 scenes (https://pbrt.org/fileformat-v4).
#pragma once

#include "common/scene_io/file_finder.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Reads a scene's text and the files that it names: included files, PLY meshes, images and spectra. Colours are
/// spectra in pbrt and linear RGB here (spectrum.h). Notices list differences from pbrt's rendering. Unknown parameters
/// and missing images are faults. Everything else that cannot be rendered is an error: "scene.pbrt:12: Shape sphere:
/// …". `files` finds files from the folder of the scene, as pbrt does.
Result<LoadedScene> read_pbrt(std::string text, const std::string& file_name, FileSource files);

}  // namespace lightmill
