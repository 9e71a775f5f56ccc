// What --help prints.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// Wrapped to so many columns.
std::string help_page(const CommandDoc& command, int columns);

/// In the width of standard output's terminal, or in 100 columns.
std::string help_page_for_terminal(const CLI::App& app);

/// Has `app` and all its commands print that for --help.
void use_help_pages(CLI::App& app);

}  // namespace lightmill
