// Ctrl-C, once and twice.
#include "client/cli/signals.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace lightmill::cli {
namespace {

TEST(Signals, ASecondCtrlCEndsTheProcessAfterItsCleanup) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto interrupt_twice = [] {
    Signals signals;
    signals.before_exit([] { static_cast<void>(!::write(STDERR_FILENO, "all is put back", 15)); });
    ::kill(::getpid(), SIGINT);
    while (!signals.interrupted()) {
      signals.sleep(std::chrono::milliseconds(10));
    }
    ::kill(::getpid(), SIGINT);
    ::sleep(60);
  };
  EXPECT_EXIT(interrupt_twice(), testing::ExitedWithCode(130), "all is put back");
}

}  // namespace
}  // namespace lightmill::cli
