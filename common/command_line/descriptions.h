// Descriptions of a program's commands and options: shell completions, its manual page, its part of docs/reference.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// Shell script that completes commands, options and values. To be sourced, or installed beside the others under the program's name.
std::string bash_completion(const CommandDoc& program);
/// To be installed as _NAME in a folder of zsh's $fpath.
std::string zsh_completion(const CommandDoc& program);
/// To be installed beside the others as NAME.fish.
std::string fish_completion(const CommandDoc& program);

/// Manual page for section 1, in man macros. The footer shows `date` ("2026-11-23") and `version`.
std::string man_page(const CommandDoc& program, const std::string& version, const std::string& date);

/// Part of docs/reference/command-line.md: sections for the program, each command, and the options that several commands have.
std::string markdown_page(const CommandDoc& program);

}  // namespace lightmill
