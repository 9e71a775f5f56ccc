// How wide text is in a terminal.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace lightmill::cli {

inline bool starts_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xc0) != 0x80;
}

/// Columns of UTF-8 text without wide characters.
inline int columns_of(std::string_view text) {
  return static_cast<int>(std::ranges::count_if(text, starts_character));
}

/// The first `columns` columns.
inline std::string cut_to_columns(std::string_view text, int columns) {
  std::size_t end = 0;
  for (int seen = 0; end < text.size(); ++end) {
    if (starts_character(text[end]) && seen++ == columns) {
      break;
    }
  }
  return std::string(text.substr(0, end));
}

}  // namespace lightmill::cli
