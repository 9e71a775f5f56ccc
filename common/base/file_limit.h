// The limit of a process's open files and connections.
#pragma once

#include <cstdint>

namespace lightmill {

/// Raises the process's limit to the most that the system allows, and returns that. Each connection is a file. Shells
/// often start programs with a limit of about a thousand.
std::uint64_t raise_file_limit();

}  // namespace lightmill
