// The page that --help prints.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// Wrapped to `columns` columns.
std::string help_page(const CommandDoc& command, int columns);

/// Wrapped to the width of standard output's terminal, else to 100 columns.
std::string help_page_for_terminal(const CLI::App& app);

/// Makes `app` and all its commands print this page for --help.
void use_help_pages(CLI::App& app);

}  // namespace lightmill
