// Aligned columns that fit the terminal.
#pragma once

#include <string>
#include <vector>

#include "client/cli/console.h"

namespace lightmill::cli {

using Rows = std::vector<std::vector<std::string>>;

/// Rows under a header, columns padded to their widest cell. Cells are UTF-8; control characters in them are escaped.
/// Where `width` columns (0: no limit) are too few, the widest column is wrapped; if that is not enough, each row takes
/// several lines. Nothing is left out.
std::vector<std::string> format_table(Rows rows, int width);

/// A line for each row, cut at `width` columns (0: no limit).
std::vector<std::string> format_table_in_lines(Rows rows, int width);

/// Prints rows as human output, fitted to standard output's terminal if it is one.
void print_table(const Console& console, const Rows& rows);

}  // namespace lightmill::cli
