// A small disk that a test can fill.
#pragma once

#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// A private disk in memory. Temporary folders are on it while it exists. Needs root.
class SmallDisk {
 public:
  explicit SmallDisk(int mib) {
    if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, fmt::format("size={}m", mib).c_str()) != 0) {
      return;
    }
    mounted_ = true;
    tmpdir_.emplace(folder_.path());
  }
  ~SmallDisk() {
    tmpdir_.reset();
    if (mounted_) {
      ::umount2(folder_.path().c_str(), MNT_DETACH);
    }
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool mounted() const { return mounted_; }
  /// Fills `mib` MiB of it, or all free space.
  void fill(int mib) const {
    std::ofstream file(ballast(), std::ios::binary | std::ios::app);
    const std::string piece(1 << 16, 'x');
    for (int i = 0; i < 16 * mib && file.write(piece.data(), static_cast<std::streamsize>(piece.size())).flush(); ++i) {
    }
  }
  void make_room() const { std::filesystem::remove(ballast()); }

 private:
  std::filesystem::path ballast() const { return folder_.path() / "ballast"; }
  TemporaryFolder folder_;
  bool mounted_ = false;
  std::optional<ScopedTmpdir> tmpdir_;
};

}  // namespace lightmill::test
