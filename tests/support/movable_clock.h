// The clock of one program, which a test can change while the program runs.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// Time of day of programs that are started with environment(). Their monotonic clock stays the real one.
class MovableClock {
 public:
  MovableClock() {
    EXPECT_TRUE(std::filesystem::exists(kLibrary)) << "install libfaketime (deploy/setup --tests does)";
    move("+0");
  }
  Environment environment() const {
    return {{"LD_PRELOAD", kLibrary},
            {"FAKETIME_TIMESTAMP_FILE", file_.string()},
            {"FAKETIME_NO_CACHE", "1"},
            {"FAKETIME_DONT_FAKE_MONOTONIC", "1"}};
  }
  /// Sets the offset from the real time, such as "+400d" or "-3h".
  void move(const std::string& offset) const {
    const std::filesystem::path next = file_.string() + ".next";
    std::ofstream(next) << offset << "\n";
    std::filesystem::rename(next, file_);
  }

 private:
  static constexpr const char* kLibrary = "/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1";
  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "clock";
};

}  // namespace lightmill::test
