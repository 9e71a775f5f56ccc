// Reader of Mitsuba 3 scenes (https://mitsuba.readthedocs.io).
#pragma once

#include "common/scene_io/file_finder.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Reads a scene's XML and the files that it names: included files, meshes, images and spectra. Colours have the values
/// of Mitsuba's RGB variants. Notices list differences from Mitsuba's rendering. Unknown parameters and missing images
/// are faults. Everything else that cannot be rendered is an error: "scene.xml:12: shape sphere: …". `files` finds
/// files from the folder of the scene, as Mitsuba does.
Result<LoadedScene> read_mitsuba(std::string text, const std::string& file_name, FileSource files);

}  // namespace lightmill
