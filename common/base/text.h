// Text from elsewhere: what may be stored as a name, and what is safe to print.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Names of jobs, owners, hosts and workers are no longer.
inline constexpr std::size_t kMaxNameBytes = 200;

/// INVALID_ARGUMENT beginning with `what`, unless `name` is UTF-8 of at most kMaxNameBytes bytes without control
/// characters (Unicode's C0 and C1, line separators, and what turns the direction of writing). May be empty.
Status check_name(std::string_view what, std::string_view name);

/// `text` with control characters and bytes that are not UTF-8 written as \xHH or \uHHHH, so that a terminal only shows
/// it. Line feeds and tabs stay if `keep_lines`.
std::string printable(std::string_view text, bool keep_lines = false);

/// `text`, or the whole characters of its first `most_bytes` and "…". UTF-8.
std::string cut_text(std::string text, std::size_t most_bytes);

/// The nearest thing to `text` that check_name takes: printable and cut.
std::string as_name(std::string_view text);

}  // namespace lightmill
