// Sentences in messages, and lists of them. Private to common/wire.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/base/text.h"
#include "common/wire/limits.h"

namespace lightmill {

/// A sentence made fit for a message: it may quote files with any bytes. Protobuf refuses a whole message with an
/// invalid string, and the stream would end.
inline std::string sentence(std::string_view text) {
  return cut_text(printable(text, true), kMaxReasonBytes - std::string_view("…").size());
}

/// Reads a repeated field of strings: at most kMaxMethodNotes, of at most kMaxReasonBytes each.
template <class Repeated>
Result<std::vector<std::string>> texts_from_wire(std::string_view field, const Repeated& texts) {
  if (static_cast<std::size_t>(texts.size()) > kMaxMethodNotes) {
    return invalid_argument("{}: {} are more than the limit of {}", field, texts.size(), kMaxMethodNotes);
  }
  for (const std::string& text : texts) {
    LM_RETURN_IF_ERROR(check_length(field, text, kMaxReasonBytes));
  }
  return std::vector<std::string>(texts.begin(), texts.end());
}

}  // namespace lightmill
