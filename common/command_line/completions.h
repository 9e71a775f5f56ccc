// Scripts by which shells complete a program's commands, options and values.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// To be sourced, or put beside the others as the program's name.
std::string bash_completion(const CommandDoc& program);
/// To be put into a folder of zsh's $fpath as _NAME.
std::string zsh_completion(const CommandDoc& program);
/// To be put beside the others as NAME.fish.
std::string fish_completion(const CommandDoc& program);

}  // namespace lightmill
