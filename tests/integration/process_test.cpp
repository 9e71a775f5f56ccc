// Background processes of tests: their crashes fail the test, and they can end before they are killed.
#include "tests/support/process.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "common/base/file.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

/// A shell that runs `commands`.
class Shell {
 public:
  explicit Shell(const std::string& commands) : process_({"/bin/sh", "-c", commands}, log_.string()) {}
  BackgroundProcess& process() { return process_; }
  bool ends() {
    return eventually([this] { return !process_.runs(); });
  }
  bool says(const std::string& words) const { return read_file(log_).value().find(words) != std::string::npos; }

 private:
  const TemporaryFolder folder_;
  const std::filesystem::path log_ = folder_.path() / "log";
  BackgroundProcess process_;
};

TEST(Crashes, AnUnexpectedExitCodeFailsTheTest) {
  const auto crash = [] { EXPECT_TRUE(Shell("exit 3").ends()); };
  EXPECT_NONFATAL_FAILURE(crash(), "/bin/sh ended with code 3");
  EXPECT_EQ(Shell("exit 3").process().wait(), 3);
}

TEST(Crashes, ASignalThatTheTestDidNotSendFailsTheTest) {
  const auto crash = [] {
    Shell shell("trap 'kill -ABRT $$' TERM; echo ready; while :; do sleep 0.01; done");
    EXPECT_TRUE(eventually([&] { return shell.says("ready"); }));
    shell.process().send(SIGTERM);
    EXPECT_EQ(shell.process().wait(), 128 + SIGABRT);
  };
  EXPECT_NONFATAL_FAILURE(crash(), "/bin/sh was ended by signal 6");
}

TEST(Crashes, AFaultInTheLogFailsTheTest) {
  const auto crash = [] {
    Shell shell("echo 'film.cpp:7: check failed: samples > 0'");
    EXPECT_EQ(shell.process().wait(), 0);
  };
  EXPECT_NONFATAL_FAILURE(crash(), "/bin/sh reports a fault: : check failed: samples > 0");
}

TEST(Crashes, ExitsThatTheTestCausesAreNoCrashes) {
  EXPECT_TRUE(Shell("exit 0").ends());
  Shell killed("exec sleep 1000"), stopped("exec sleep 1000");
  killed.process().send(SIGKILL);
  EXPECT_TRUE(killed.ends());
  stopped.process().send(SIGTERM);
  EXPECT_TRUE(stopped.ends());
  const Shell running("exec sleep 1000");
}

/// Sets LIGHTMILL_LEAVE_MS in its scope.
class LeaveMs {
 public:
  explicit LeaveMs(const char* value) : before_(std::getenv(kName) ? std::getenv(kName) : "") {
    ::setenv(kName, value, 1);
  }
  ~LeaveMs() { before_.empty() ? ::unsetenv(kName) : ::setenv(kName, before_.c_str(), 1); }

 private:
  static constexpr const char* kName = "LIGHTMILL_LEAVE_MS";
  const std::string before_;
};

/// Output of a shell with these commands until the end of its scope. It begins with "ready".
std::string written_by(const std::string& commands, bool stopped) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder.path() / "log";
  {
    BackgroundProcess shell({"/bin/sh", "-c", commands}, log.string());
    EXPECT_TRUE(eventually([&] { return read_file(log).value().starts_with("ready"); }));
    if (stopped) {
      shell.send(SIGSTOP);
    }
  }
  return read_file(log).value();
}

TEST(BackgroundProcess, CanWriteItsCountsBeforeItIsKilled) {
  const std::string counts = "trap 'echo counts; exit 130' TERM; echo ready; while :; do sleep 0.01; done";
  {
    const LeaveMs asked("100000");
    EXPECT_EQ(written_by(counts, false), "ready\ncounts\n");
    EXPECT_EQ(written_by(counts, true), "ready\ncounts\n");
  }
  const LeaveMs not_long("1");
  EXPECT_EQ(written_by("trap '' TERM; echo ready; while :; do sleep 0.01; done", false), "ready\n");
}

}  // namespace
}  // namespace lightmill::test
