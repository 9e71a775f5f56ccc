// Aligned columns that fit the terminal.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/console.h"

namespace lightmill::cli {

/// "cornell-be…blocks": the first and the last characters, if the text has more columns.
std::string shortened(std::string_view text, int columns);

using Rows = std::vector<std::vector<std::string>>;

/// The colours of a column's cells in a terminal.
struct Coloring {
  std::size_t column = 0;
  /// Maps a cell's text to an SGR code, e.g. 31 (red). 0: none.
  std::function<int(std::string_view)> code = [](std::string_view) { return 0; };
};

/// Rows under a header, with columns padded to their widest cell. Cells are UTF-8. Control characters in them are
/// escaped. If `width` columns (0: no limit) are too few, wide columns are wrapped. If that is not enough, the last
/// columns move to an indented line below each row, as "owner ada; size 96x80", without those that are empty or "-". A
/// name in the first columns that is longer than half of `width` loses its middle, and stands whole on that line. Rows
/// of two cells need no header: they are only wrapped.
std::vector<std::string> format_table(Rows rows, int width, const Coloring& coloring = {});

/// The same, with the lines of each row apart.
std::vector<std::vector<std::string>> format_rows(Rows rows, int width, const Coloring& coloring = {});

/// What a table gives up, so that each row fits one line.
struct Squeeze {
  /// Column whose long cells lose their middle. Cells that would look alike lose what they have in common.
  std::size_t name = 0;
  std::size_t kept = 0;  ///< number of columns that stay. Those after them are left out, from the last
};

/// The rows for format_table with this `width`, which is not 0. If even the kept columns do not fit, format_table moves
/// some below the row. Then the others stay as long as that takes one line.
Rows squeezed(Rows rows, int width, const Squeeze& squeeze);

/// Prints rows for people. In a terminal they are fitted to it, and coloured if colors_wanted.
void print_table(const Console& console, const Rows& rows, const Coloring& coloring = {});
/// The same after squeezed(), if the output has a width.
void print_table(const Console& console, Rows rows, const Coloring& coloring, const Squeeze& squeeze);

}  // namespace lightmill::cli
