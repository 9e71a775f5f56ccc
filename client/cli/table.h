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
/// escaped. If `width` columns (0: no limit) are too few, the widest columns are wrapped. If that is not enough, each
/// row takes several lines. No text is left out.
std::vector<std::string> format_table(Rows rows, int width, const Coloring& coloring = {});

/// A line for each row, of at most `width` columns (0: no limit). If they are too few, the widest cells lose their
/// middle. If that is not enough, the last columns are left out. The first column stays whole if it fits, because
/// commands take its text.
std::vector<std::string> format_table_in_lines(Rows rows, int width, const Coloring& coloring = {});

/// "hidden: SAMPLES, OWNER (needs 96 columns)", the columns that format_table_in_lines leaves out. Empty if none.
std::string hidden_columns(Rows rows, int width);

/// "shortened: NAME (needs 131 columns)", the columns with cells that format_table_in_lines shortens. Empty if none.
std::string shortened_columns(Rows rows, int width);

/// Prints rows for people. In a terminal they are fitted to it, and coloured if colors_wanted.
void print_table(const Console& console, const Rows& rows, const Coloring& coloring = {});

/// The same with a line for each row. A notice names the columns that are left out or shortened.
void print_table_in_lines(const Console& console, const Rows& rows, const Coloring& coloring = {});

}  // namespace lightmill::cli
