// How much memory this process may come to use.
#pragma once

#include <cstdint>
#include <filesystem>

namespace lightmill {

/// Bytes of the machine, or what the control groups that this process is in allow, where that is less. `root` is where
/// /proc and /sys lie. What cannot be read limits nothing; 0 if nothing can.
std::uint64_t usable_memory(const std::filesystem::path& root = "/");

/// A default for an option in GiB: this share of the usable memory, at most `most`; `most` where nothing limits it.
double share_of_memory_gib(double share, double most, const std::filesystem::path& root = "/");

}  // namespace lightmill
