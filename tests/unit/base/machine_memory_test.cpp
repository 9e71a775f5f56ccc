#include "common/base/machine_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

class MachineMemory : public ::testing::Test {
 protected:
  void put(const std::string& path, const std::string& text) const {
    const std::filesystem::path file = folder_.path() / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  std::uint64_t usable() const { return usable_memory(folder_.path()); }
  double share_gib(double share, double most) const { return share_of_memory_gib(share, most, folder_.path()); }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(MachineMemory, IsThePhysicalMemoryWithoutAGroupLimit) {
  put("proc/meminfo", "MemTotal:       16384 kB\nMemFree:        1 kB\n");
  EXPECT_EQ(usable(), 16384u << 10);
  put("proc/self/cgroup", "0::/user.slice\n");
  put("sys/fs/cgroup/user.slice/memory.max", "max\n");
  EXPECT_EQ(usable(), 16384u << 10);
}

TEST_F(MachineMemory, DefaultsAreABoundedShareOfIt) {
  EXPECT_EQ(share_gib(0.5, 4), 4) << "nothing says how much there is";
  put("proc/meminfo", "MemTotal:       2097152 kB\n");
  EXPECT_EQ(share_gib(0.5, 4), 1);
  EXPECT_EQ(share_gib(0.5, 0.75), 0.75);
  EXPECT_EQ(share_gib(1e-9, 4), 0.001) << "the least that the options take";
}

TEST_F(MachineMemory, IsTheSmallestLimitOfTheNestedGroups) {
  put("proc/meminfo", "MemTotal:       16384 kB\n");
  put("proc/self/cgroup", "0::/a/b\n");
  put("sys/fs/cgroup/a/memory.max", "5000000\n");
  put("sys/fs/cgroup/a/b/memory.max", "6000000\n");
  EXPECT_EQ(usable(), 5'000'000u);
}

TEST_F(MachineMemory, AContainersLimitIsInTheRootGroup) {
  put("proc/meminfo", "MemTotal:       16384 kB\n");
  put("proc/self/cgroup", "0::/somewhere/else\n");
  put("sys/fs/cgroup/memory.max", "4000000\n");
  EXPECT_EQ(usable(), 4'000'000u);
}

TEST_F(MachineMemory, GroupsOfVersionOneAreRead) {
  put("proc/meminfo", "MemTotal:       16384 kB\n");
  put("proc/self/cgroup", "12:cpu,cpuacct:/x\n4:memory:/job\nnonsense\n");
  put("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  put("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "3000000\n");
  EXPECT_EQ(usable(), 3'000'000u);
}

TEST_F(MachineMemory, ProcessLimitsCount) {
  put("proc/meminfo", "MemTotal:       16384 kB\n");
  put("proc/self/limits",
      "Limit                     Soft Limit           Hard Limit           Units     \n"
      "Max data size             unlimited            unlimited            bytes     \n"
      "Max address space         4000000              5000000              bytes     \n");
  EXPECT_EQ(usable(), 4'000'000u);
  put("proc/self/limits",
      "Max data size             3000000              unlimited            bytes     \n"
      "Max address space         unlimited            unlimited            bytes     \n");
  EXPECT_EQ(usable(), 3'000'000u);
}

TEST_F(MachineMemory, IsUnknownWithoutReadableFiles) {
  EXPECT_EQ(usable(), 0u);
}

TEST(UsableMemory, IsNoMoreThanThisMachineHas) {
  const auto physical =
      static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  EXPECT_GT(usable_memory(), std::uint64_t{1} << 20);
  EXPECT_LE(usable_memory(), physical);
}

}  // namespace
}  // namespace lightmill
