// Words of a command that people paste into a shell.
#pragma once

#include <string>

namespace lightmill {

/// The word as a shell needs it: in quotes unless all of its characters are plain.
std::string shell_word(const std::string& word);

}  // namespace lightmill
