// A reader that fills a protobuf message from JSON text by its descriptor. For scene_json only.
#pragma once

#include <google/protobuf/message.h>

#include <string_view>

#include "common/base/status.h"
#include "common/wire/scene_json.h"

namespace lightmill {

/// Reads `text` into `message`. Notes the place of each field in `source`. Errors already have their place.
Status read_json(std::string_view text, google::protobuf::Message& message, SourceMap& source);

}  // namespace lightmill
