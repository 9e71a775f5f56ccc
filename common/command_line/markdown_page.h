// A program's part of docs/reference/command-line.md.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// Sections for the program, each command, and the options that several commands have.
std::string markdown_page(const CommandDoc& program);

}  // namespace lightmill
