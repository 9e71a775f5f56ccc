// A control group with little memory.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// Its processes end before it. made() is false where control groups cannot be created. While it exists, temporary
/// folders are on disk, because files in memory count as memory of their writer.
class MemoryGroup {
 public:
  explicit MemoryGroup(int mebibytes) {
    std::ifstream groups("/proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) {  // "4:memory:/group" in version 1, "0::/group" in version 2
      const bool first_version = line.find(":memory:") != std::string::npos;
      if (first_version || line.starts_with("0::")) {
        const std::filesystem::path top = first_version ? "/sys/fs/cgroup/memory" : "/sys/fs/cgroup";
        const std::filesystem::path group = line.substr(line.find('/') + 1);
        try_to_make(top / group / ("lightmill-test-" + std::to_string(::getpid()) + "-" + std::to_string(next_++)),
                    first_version ? "memory.limit_in_bytes" : "memory.max", mebibytes);
      }
    }
  }
  MemoryGroup(const MemoryGroup&) = delete;
  MemoryGroup& operator=(const MemoryGroup&) = delete;
  ~MemoryGroup() {
    if (made()) {
      EXPECT_TRUE(eventually([&] { return ::rmdir(folder_.c_str()) == 0; })) << folder_ << " is in use";
    }
  }

  bool made() const { return !folder_.empty(); }
  /// The program that starts another program in the group.
  std::vector<std::string> starter() const {
    return {"/bin/sh", "-c", "echo $$ >" + (folder_ / "cgroup.procs").string() + " && exec \"$@\"", "sh"};
  }

 private:
  void try_to_make(const std::filesystem::path& folder, const char* limit, int mebibytes) {
    std::error_code error;
    if (made() || !std::filesystem::create_directory(folder, error)) {
      return;
    }
    std::ofstream file(folder / limit);
    file << (static_cast<long long>(mebibytes) << 20) << std::flush;
    if (file) {
      folder_ = folder;
    } else {
      ::rmdir(folder.c_str());
    }
  }

  inline static int next_ = 0;
  std::filesystem::path folder_;
  ScopedTmpdir tmpdir_{"/var/tmp"};
};

}  // namespace lightmill::test
