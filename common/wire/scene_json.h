// Scene files: the JSON form of lightmill.v1.Scene.
//
// Unlike in proto's JSON form, Vec2, Vec3 and Color.Rgb may also be lists of their numbers. Duplicate and unknown
// fields, null, NaN and infinities are errors. Errors read "scenes/box.json:12:7: objects[3].material: unknown material
// …". They have line and column of the wrong value (in bytes, from 1), path of the field, what is wrong and what is
// expected.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/wire/scene_proto.h"

namespace lightmill {

/// The places of a document's fields in its file.
class SourceMap {
 public:
  SourceMap() = default;
  SourceMap(std::string file_name, std::string_view text);

  void add(std::string field_path, std::size_t offset) { offsets_.emplace(std::move(field_path), offset); }
  /// "file:line:column" of a field, or of the innermost field around it that is in the file.
  std::string place(std::string_view field_path) const;
  std::string place_of_offset(std::size_t offset) const;
  /// Puts the place before an error that begins with a field's path.
  Status located(const Status& status) const;

 private:
  /// The place of every so many bytes, so that a place does not cost a pass over the text.
  struct Mark {
    std::size_t lines = 0;       ///< that end before
    std::size_t line_start = 0;  ///< offset of this line
  };

  std::string file_name_;
  std::string text_;
  std::vector<Mark> marks_;
  std::map<std::string, std::size_t, std::less<>> offsets_;
};

struct SceneFile {
  SceneDraft draft;
  SourceMap source;  ///< for later errors, such as a missing mesh
};

/// Reads a scene document. `file_name` is only for messages.
Result<SceneFile> read_scene_json(std::string_view text, const std::string& file_name);

/// Reads a file with the JSON form of a lightmill.v1.Camera.
Result<Camera> read_camera_json(std::string_view text, const std::string& file_name);

/// The text of a file that read_camera_json reads back as the same camera, to the last bit.
std::string write_camera_json(const Camera& camera);

}  // namespace lightmill
