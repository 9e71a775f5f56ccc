// The memory and the open files that this process can use.
#pragma once

#include <cstdint>
#include <filesystem>

namespace lightmill {

/// The least of the machine's memory, the limits of the process's control groups, and its own limits (ulimit -v, ulimit
/// -d), in bytes. `root` is the parent of /proc and /sys. A limit that cannot be read counts as none. 0 if there is
/// none.
std::uint64_t usable_memory(const std::filesystem::path& root = "/");

/// Limits this process's data, so that allocations fail (std::bad_alloc) shortly before its control group is full.
/// Otherwise the kernel kills the process without a message. Does nothing without such a group. Call it once the
/// process's threads run, because their stacks count. Memory of other processes in the group, and files in memory, are
/// not considered.
void stay_within_group_memory();

/// The default of an option in GiB: this share of the usable memory, at most `most`. `most` if nothing limits the
/// memory.
double share_of_memory_gib(double share, double most, const std::filesystem::path& root = "/");

/// Raises the process's limit of open files to the most that the system allows, and returns that. Each connection takes
/// one. Shells often start programs with a limit of about a thousand.
std::uint64_t raise_file_limit();

}  // namespace lightmill
