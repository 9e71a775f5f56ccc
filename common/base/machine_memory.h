// How much memory this process may come to use.
#pragma once

#include <cstdint>
#include <filesystem>

namespace lightmill {

/// Bytes of the machine, or what the control groups that this process is in, or its own limits (ulimit -v, ulimit -d),
/// allow, where that is less. `root` is where /proc and /sys lie. What cannot be read limits nothing; 0 if nothing can.
std::uint64_t usable_memory(const std::filesystem::path& root = "/");

/// Sets this process's limit of data such that it finds no more memory (std::bad_alloc) shortly before its control
/// group has none left: the kernel kills without a word. Nothing happens without such a group. To be called once the
/// process's threads run, as their stacks count. Memory that others in the group use, and files in memory, are not
/// foreseen.
void stay_within_group_memory();

/// A default for an option in GiB: this share of the usable memory, at most `most`; `most` where nothing limits it.
double share_of_memory_gib(double share, double most, const std::filesystem::path& root = "/");

}  // namespace lightmill
