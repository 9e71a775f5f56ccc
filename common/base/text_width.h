// How wide text is in a terminal.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// Columns of the terminal that this descriptor writes to; 0 if it is none.
int terminal_columns(int descriptor);

/// Columns of UTF-8 text: two for a wide character (CJK, emoji), none for one that combines with others.
int columns_of(std::string_view text);

/// As many of the first characters as fit into `columns`.
std::string cut_to_columns(std::string_view text, int columns);

/// Lines of at most so many columns, which has to be 2 or more. They end between words, or within one that is longer.
/// At least one line.
std::vector<std::string> wrap_to_columns(std::string_view text, int columns);

}  // namespace lightmill
