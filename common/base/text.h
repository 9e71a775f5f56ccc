// Text from outside: which text may be a stored name, and which is safe to print.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// The longest name of a job, owner, host or worker.
inline constexpr std::size_t kMaxNameBytes = 200;

/// INVALID_ARGUMENT that begins with `what`, unless `name` is UTF-8 of at most kMaxNameBytes bytes without control
/// characters. These are Unicode's C0 and C1, line separators, and characters that change the writing direction. May be
/// empty.
Status check_name(std::string_view what, std::string_view name);

/// `text` with control characters and invalid UTF-8 bytes written as \xHH or \uHHHH, so that a terminal only shows it.
/// `keep_lines` keeps line feeds and tabs.
std::string printable(std::string_view text, bool keep_lines = false);

/// `text` if it fits, else the whole characters of its first `most_bytes` and "…". UTF-8.
std::string cut_text(std::string text, std::size_t most_bytes);

/// `text` as a name that check_name accepts: printable and cut.
std::string as_name(std::string_view text);

}  // namespace lightmill
