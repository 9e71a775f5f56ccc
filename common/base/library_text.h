// A library's error text, made fit for the end of one of our messages.
#pragma once

#include <string>
#include <string_view>

namespace lightmill {

/// `text` on one line: its lines are trimmed and joined by "; ". The result is printable, and cut.
std::string library_text(std::string_view text);

}  // namespace lightmill
