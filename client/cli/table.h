// Aligned columns that fit the terminal.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/console.h"

namespace lightmill::cli {

using Rows = std::vector<std::vector<std::string>>;

/// The colours of a column's cells in a terminal.
struct Coloring {
  std::size_t column = 0;
  /// Maps a cell's text to an SGR code, e.g. 31 (red). 0: none.
  std::function<int(std::string_view)> code = [](std::string_view) { return 0; };
};

/// Rows under a header, with columns padded to their widest cell. Cells are UTF-8. Control characters in them are
/// escaped. If `width` columns (0: no limit) are too few, wide columns are wrapped. If that is not enough, the last
/// columns move to an indented line below each row, as "owner ada, size 96x80", without those that are empty or "-". A
/// name in the first columns that is longer than half of `width` loses its middle, and stands whole on that line. Rows
/// of two cells need no header: they are only wrapped.
std::vector<std::string> format_table(Rows rows, int width, const Coloring& coloring = {});

/// The same, with the lines of each row apart.
std::vector<std::vector<std::string>> format_rows(Rows rows, int width, const Coloring& coloring = {});

/// Prints rows for people. In a terminal they are fitted to it, and coloured if colors_wanted.
void print_table(const Console& console, const Rows& rows, const Coloring& coloring = {});

}  // namespace lightmill::cli
