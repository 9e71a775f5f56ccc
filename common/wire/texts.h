// Sentences on the wire, and lists of them. Private to common/wire.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/base/text.h"
#include "common/wire/limits.h"

namespace lightmill {

/// What is sent in place of a sentence that may quote files of any bytes: a message with such a string would be refused
/// whole, and its stream end.
inline std::string sentence(std::string_view text) {
  return cut_text(printable(text, true), kMaxReasonBytes - std::string_view("…").size());
}

/// A repeated field of strings: at most kMaxMethodNotes of at most kMaxReasonBytes each.
template <class Repeated>
Result<std::vector<std::string>> texts_from_wire(std::string_view field, const Repeated& texts) {
  if (static_cast<std::size_t>(texts.size()) > kMaxMethodNotes) {
    return invalid_argument("{}: {} are more than the limit of {}", field, texts.size(), kMaxMethodNotes);
  }
  for (const std::string& text : texts) {
    if (text.size() > kMaxReasonBytes) {
      return invalid_argument("{}: {} bytes are more than the limit of {}", field, text.size(), kMaxReasonBytes);
    }
  }
  return std::vector<std::string>(texts.begin(), texts.end());
}

}  // namespace lightmill
