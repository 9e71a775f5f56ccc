// Aligned columns that fit the terminal.
#pragma once

#include <string>
#include <vector>

#include "client/cli/console.h"

namespace lightmill::cli {

/// Rows under a header, columns padded to their widest cell; lines are cut at `width` columns (0: no
/// limit). Cells are UTF-8; control characters in them are escaped.
std::vector<std::string> format_table(std::vector<std::vector<std::string>> rows, int width);

/// Prints rows as human output, fitted to standard output's terminal if it is one.
void print_table(const Console& console, const std::vector<std::vector<std::string>>& rows);

}  // namespace lightmill::cli
