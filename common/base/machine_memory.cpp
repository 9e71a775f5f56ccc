#include "common/base/machine_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// Of /proc/meminfo.
std::uint64_t machine_bytes(const fs::path& root) {
  std::ifstream file(root / "proc/meminfo");
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    std::uint64_t kib = 0;
    if (words >> name >> kib && name == "MemTotal:") {
      return kib << 10;
    }
  }
  return kUnlimited;
}

/// The first number of a file; "max", as unlimited groups say, is none.
std::uint64_t number_in(const fs::path& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

/// The least limit of the group and of all that it lies in. Seen from within a container the group's own path may not
/// exist, and the limit stands at the top.
std::uint64_t group_bytes(const fs::path& top, const fs::path& group, const char* file) {
  std::uint64_t least = number_in(top / file);
  fs::path folder = top;
  for (const fs::path& part : group.relative_path()) {
    folder /= part;
    least = std::min(least, number_in(folder / file));
  }
  return least;
}

}  // namespace

std::uint64_t usable_memory(const fs::path& root) {
  std::uint64_t least = machine_bytes(root);
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // "ID:controllers:path", without controllers in version 2
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) {
      continue;
    }
    const std::string controllers = fmt::format(",{},", line.substr(first + 1, second - first - 1));
    const fs::path group = line.substr(second + 1);
    if (controllers == ",,") {
      least = std::min(least, group_bytes(root / "sys/fs/cgroup", group, "memory.max"));
    } else if (controllers.find(",memory,") != std::string::npos) {
      least = std::min(least, group_bytes(root / "sys/fs/cgroup/memory", group, "memory.limit_in_bytes"));
    }
  }
  return least == kUnlimited ? 0 : least;
}

double share_of_memory_gib(double share, double most, const fs::path& root) {
  constexpr double kLeast = 0.001;  // that the options take
  const std::uint64_t bytes = usable_memory(root);
  return bytes == 0 ? most : std::clamp(share * static_cast<double>(bytes) / (1 << 30), kLeast, most);
}

}  // namespace lightmill
