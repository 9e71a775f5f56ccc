// Lists of sentences on the wire. Private to common/wire.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/wire/limits.h"

namespace lightmill {

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
