// Crashes of a test's processes fail the test, also where the farm recovers from them.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <csignal>

#include "common/base/file.h"
#include "tests/support/farm.h"

namespace lightmill::test {
namespace {

TEST(Crashes, AWorkersCrashFailsTheTestEvenIfTheFarmRecovers) {
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

}  // namespace
}  // namespace lightmill::test
