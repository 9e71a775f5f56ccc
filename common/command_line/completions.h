// Shell scripts that complete a program's commands, options and values.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// To be sourced, or installed beside the others under the program's name.
std::string bash_completion(const CommandDoc& program);
/// To be installed as _NAME in a folder of zsh's $fpath.
std::string zsh_completion(const CommandDoc& program);
/// To be installed beside the others as NAME.fish.
std::string fish_completion(const CommandDoc& program);

}  // namespace lightmill
