#include "common/wire/scene_json.h"

#include <google/protobuf/util/json_util.h>
#include <algorithm>

#include "common/base/check.h"
#include "common/wire/json_reader.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {

namespace {

constexpr std::size_t kMarkBytes = 4096;

}  // namespace

SourceMap::SourceMap(std::string file_name, std::string_view text) : file_name_(std::move(file_name)), text_(text) {
  Mark mark;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (at % kMarkBytes == 0) {
      marks_.push_back(mark);
    }
    if (text[at] == '\n') {
      mark = {mark.lines + 1, at + 1};
    }
  }
}

std::string SourceMap::place_of_offset(std::size_t offset) const {
  offset = std::min(offset, text_.size());
  Mark mark;
  std::size_t at = 0;
  if (!marks_.empty()) {
    const std::size_t last = std::min(offset / kMarkBytes, marks_.size() - 1);
    mark = marks_[last];
    at = last * kMarkBytes;
  }
  for (; at < offset; ++at) {
    if (text_[at] == '\n') {
      mark = {mark.lines + 1, at + 1};
    }
  }
  return fmt::format("{}:{}:{}", file_name_, mark.lines + 1, offset - mark.line_start + 1);
}

std::string SourceMap::place(std::string_view field_path) const {
  for (;;) {
    if (const auto found = offsets_.find(field_path); found != offsets_.end()) {
      return place_of_offset(found->second);
    }
    if (field_path.empty()) {
      return file_name_;
    }
    const std::size_t cut = field_path.find_last_of(".[");
    field_path = field_path.substr(0, cut == std::string_view::npos ? 0 : cut);
  }
}

Status SourceMap::located(const Status& status) const {
  if (status.ok()) {
    return status;
  }
  const std::string message = message_of(status);
  return with_context(status, place(std::string_view(message).substr(0, message.find(": "))));
}

Result<SceneFile> read_scene_json(std::string_view text, const std::string& file_name) {
  SceneFile file{{}, SourceMap(file_name, text)};
  v1::Scene message;
  LM_RETURN_IF_ERROR(read_json(text, message, file.source));
  Result<SceneDraft> draft = draft_from_wire(message);
  if (!draft.ok()) {
    return file.source.located(draft.status());
  }
  file.draft = *std::move(draft);
  return file;
}

Result<Camera> read_camera_json(std::string_view text, const std::string& file_name) {
  SourceMap source(file_name, text);
  v1::Camera message;
  LM_RETURN_IF_ERROR(read_json(text, message, source));
  Result<Camera> camera = from_wire(message);
  if (!camera.ok()) {
    // The file is the camera itself, so its paths do not begin with "camera".
    constexpr std::string_view kPrefix = "camera.";
    const std::string text_of_error = message_of(camera.status());
    const bool prefixed = text_of_error.starts_with(kPrefix);
    return source.located(
        make_error(camera.status().code(), "{}", text_of_error.substr(prefixed ? kPrefix.size() : 0)));
  }
  return camera;
}

std::string write_camera_json(const Camera& camera) {
  Scene scene;
  scene.camera = camera;
  v1::Scene message;
  to_wire(scene, &message);
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;  // prints coordinates that are 0
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message.camera(), &text, options);
  LM_CHECK(status.ok(), "{}", status.ToString());
  return text;
}

}  // namespace lightmill
