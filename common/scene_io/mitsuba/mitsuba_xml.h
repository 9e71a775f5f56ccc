// The XML files of a Mitsuba scene as objects.
#pragma once

#include <deque>

#include "common/scene_io/file_finder.h"
#include "common/scene_io/mitsuba/mitsuba_object.h"

namespace lightmill {

/// The folders of <path>, with a slash at the end. They are searched in this order.
using MitsubaFolders = std::vector<std::string>;

/// The file in one of the folders, else in that of the scene.
Result<SourceFile> find_mitsuba_file(FileSource& files, const MitsubaFolders& folders, const std::string& name);

struct MitsubaDocument {
  std::deque<std::string> names;      ///< of files, for places
  std::deque<MitsubaObject> objects;  ///< the first is the scene. Objects with several references are there once
  MitsubaFolders folders;
};

/// Reads a scene, with its included files, defaults and references. Parameters of files older than version 2 get their
/// later names. References can lead in a circle. Nesting, files, tags, texts and the parts of objects are
/// limited. No external entity is read.
Result<MitsubaDocument> read_mitsuba_xml(std::string text, const std::string& file_name, FileSource& files);

}  // namespace lightmill
