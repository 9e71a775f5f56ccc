// Crashes of a test's processes fail the test, also where the farm recovers from them.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <csignal>

#include "common/base/file.h"
#include "tests/support/farm.h"

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

TEST(Crashes, AWorkerThatTheTestDidNotKillFailsItAlthoughTheFarmRecovers) {
  const auto crash = [] {
    Farm farm;
    BackgroundProcess& crashing = farm.add_worker(1, "crashing");
    EXPECT_TRUE(eventually([&] { return farm.met("crashing"); }));
    ::kill(crashing.pid(), SIGSEGV);
    EXPECT_TRUE(eventually([&] { return farm.missed("crashing"); }));
    farm.add_worker(1, "next");
    const Picture picture{.side = 64, .samples = 16};
    expect_reference_film(farm.client(), farm.client().submit(picture).id(), picture);
  };
  EXPECT_NONFATAL_FAILURE(crash(), "lightmill-worker was ended by signal 11");
}

TEST(Crashes, AnExitCodeThatTheTestDidNotAskForFailsIt) {
  const auto crash = [] { EXPECT_TRUE(Shell("exit 3").ends()); };
  EXPECT_NONFATAL_FAILURE(crash(), "/bin/sh ended with code 3");
  EXPECT_EQ(Shell("exit 3").process().wait(), 3);
}

TEST(Crashes, AnotherSignalThanTheTestsFailsIt) {
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

TEST(Crashes, EndsThatTheTestCausesAreNone) {
  EXPECT_TRUE(Shell("exit 0").ends());
  Shell killed("exec sleep 1000"), stopped("exec sleep 1000");
  kill_at_once(killed.process());
  stopped.process().send(SIGTERM);
  EXPECT_TRUE(stopped.ends());
  const Shell running("exec sleep 1000");
}

}  // namespace
}  // namespace lightmill::test
