// Pages of lists: sizes and tokens.
#pragma once

#include <algorithm>
#include <charconv>
#include <string>

#include "common/base/status.h"
#include "common/base/text.h"

namespace lightmill {

inline constexpr int kMaxPage = 1'000;
inline constexpr int kDefaultPage = 100;

/// Size of a page; INVALID_ARGUMENT if negative.
inline Result<int> page_size_of(int asked) {
  if (asked < 0) {
    return invalid_argument("page_size must not be negative, got {}", asked);
  }
  return asked == 0 ? kDefaultPage : std::min(asked, kMaxPage);
}

/// Number in the page token of a list by numbers, newest first: that of the last entry before the page. 0 for the first
/// page. INVALID_ARGUMENT for other tokens.
inline Result<std::uint64_t> id_in(const std::string& token) {
  std::uint64_t id = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), id);
  if (!token.empty() && (error != std::errc() || end != token.data() + token.size() || id == 0)) {
    return invalid_argument("page_token '{}' is not one that this farm gave", printable(token));
  }
  return id;
}

}  // namespace lightmill
