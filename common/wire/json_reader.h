// Fills a protobuf message from JSON text, field by field, by its descriptor. For scene_json alone.
#pragma once

#include <google/protobuf/message.h>

#include <string_view>

#include "common/base/status.h"
#include "common/wire/scene_json.h"

namespace lightmill {

/// Reads `text` into `message` and notes in `source` where each field stands. Errors have their place already.
Status read_json(std::string_view text, google::protobuf::Message& message, SourceMap& source);

}  // namespace lightmill
