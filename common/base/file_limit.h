// How many files and connections a process may have open.
#pragma once

#include <cstdint>

namespace lightmill {

/// Raises the process's limit to the most that the system lets it have, and returns that. Each connection is a file,
/// and shells start programs with room for some thousand.
std::uint64_t raise_file_limit();

}  // namespace lightmill
