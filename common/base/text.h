// Text from outside: names, numbers, and text that is safe to print or to store.
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// The longest name of a job, owner, host or worker.
inline constexpr std::size_t kMaxNameBytes = 200;

/// INVALID_ARGUMENT that begins with `what`, unless `name` is UTF-8 of at most kMaxNameBytes bytes without control
/// or invisible characters. These are Unicode's C0 and C1, line separators, characters that change the writing direction,
/// and those that cannot be seen, except joiners. May be empty.
Status check_name(std::string_view what, std::string_view name);

/// `text` with these characters and invalid UTF-8 bytes written as \xHH or \uHHHH, so that a terminal only shows it.
/// `keep_lines` keeps line feeds and tabs.
std::string printable(std::string_view text, bool keep_lines = false);

/// `text` with invalid UTF-8 bytes written as \xHH, and all else unchanged.
std::string utf8_text(std::string_view text);

/// `text` as a JSON string, with its quotes. Bytes from 0x80 on are unchanged.
std::string json_text(std::string_view text);

/// A library's error text on one line, for the end of a sentence of ours: its lines are trimmed and joined by "; ". The
/// result has no full stop at its end, is printable, and has at most 400 bytes.
std::string library_text(std::string_view text);

/// A fault in a JSON text: where it is ("line 1, column 6"; empty if unknown), and what is wrong, as library_text.
struct JsonFault {
  std::string place, what;
};

/// From the text of an exception of nlohmann::json: "[json.exception.parse_error.101] parse error at line 1, column 6: …".
JsonFault json_fault(std::string_view exception_text);

/// `text` if it fits, else the whole characters of its first `most_bytes` and "…". UTF-8.
std::string cut_text(std::string text, std::size_t most_bytes);

/// `text` as a name that check_name accepts: printable and cut.
std::string as_name(std::string_view text);

/// The number, if it is the whole text. Blanks and a leading + are not accepted.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

}  // namespace lightmill
