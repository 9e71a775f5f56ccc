#include "common/base/machine_memory.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include "common/base/check.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// The number after `name` in a file that has one name and number per line.
std::uint64_t number_of(const fs::path& path, std::string_view name) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::uint64_t number = 0;
    if (line.starts_with(name) && std::istringstream(line.substr(name.size())) >> number) {
      return number;
    }
  }
  return kUnlimited;
}

std::uint64_t kib_of(const fs::path& path, std::string_view name) {
  const std::uint64_t kib = number_of(path, name);
  return kib == kUnlimited ? kUnlimited : kib << 10;
}

/// The first number of a file. "max", as in unlimited groups, is none.
std::uint64_t number_in(const fs::path& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

/// The least limit of the group and all its parents. Inside a container the group's own path may not exist. Then the
/// limit is at the top.
std::uint64_t group_bytes(const fs::path& top, const fs::path& group, const char* file) {
  std::uint64_t least = number_in(top / file);
  fs::path folder = top;
  for (const fs::path& part : group.relative_path()) {
    folder /= part;
    least = std::min(least, number_in(folder / file));
  }
  return least;
}

/// The least memory limit of the control groups of this process, in bytes.
std::uint64_t groups_bytes(const fs::path& root) {
  std::uint64_t least = kUnlimited;
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
  return least;
}

}  // namespace

std::uint64_t usable_memory(const fs::path& root) {
  const fs::path limits = root / "proc/self/limits";
  const std::uint64_t least = std::min({kib_of(root / "proc/meminfo", "MemTotal:"), groups_bytes(root),
                                        number_of(limits, "Max address space"), number_of(limits, "Max data size")});
  return least == kUnlimited ? 0 : least;
}

void stay_within_group_memory() {
  const std::uint64_t group = groups_bytes("/"), machine = kib_of("/proc/meminfo", "MemTotal:");
  const std::uint64_t data = kib_of("/proc/self/status", "VmData:"), used = kib_of("/proc/self/status", "RssAnon:");
  rlimit limit{};
  if (group >= machine || data == kUnlimited || used == kUnlimited || ::getrlimit(RLIMIT_DATA, &limit) != 0) {
    return;
  }
  const std::uint64_t most = group - group / 16;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, data + (most > used ? most - used : 0));
  ::setrlimit(RLIMIT_DATA, &limit);
}

double share_of_memory_gib(double share, double most, const fs::path& root) {
  constexpr double kMin = 0.001;  // the least value that the options accept
  const std::uint64_t bytes = usable_memory(root);
  return bytes == 0 ? most : std::clamp(share * static_cast<double>(bytes) / (1 << 30), kMin, most);
}

std::uint64_t raise_file_limit() {
  rlimit limit{};
  LM_CHECK(::getrlimit(RLIMIT_NOFILE, &limit) == 0);
  const rlimit most{limit.rlim_max, limit.rlim_max};
  return ::setrlimit(RLIMIT_NOFILE, &most) == 0 ? most.rlim_cur : limit.rlim_cur;
}

}  // namespace lightmill
