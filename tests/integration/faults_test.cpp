// Real processes with slow, stalling and broken connections, stopped processes, and jumping clocks.
#include <gtest/gtest.h>

#include <signal.h>

#include <random>

#include "tests/support/farm.h"
#include "tests/support/fault_proxy.h"
#include "tests/support/movable_clock.h"

namespace lightmill::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kSide = 72;
constexpr std::uint64_t kPixels = kSide * kSide;

Picture picture_of(std::uint64_t samples) {
  Picture picture;
  picture.side = kSide;
  picture.samples = samples;
  return picture;
}

/// Two workers, each behind its own proxy, and a job.
class FaultyConnections : public ::testing::Test {
 protected:
  FaultyConnections()
      : proxies_{std::make_unique<FaultProxy>(farm_.address()), std::make_unique<FaultProxy>(farm_.address())} {
    for (std::size_t i = 0; i < proxies_.size(); ++i) {
      farm_.add_worker(1, fmt::format("w{}", i + 1), {proxies_[i]->address(), {}, {}});
    }
    job_ = farm_.client().submit(picture_).id();
    farm_.client().wait_for_samples(job_, kPixels);
    EXPECT_TRUE(eventually([&] { return farm_.met("w1") && farm_.met("w2"); }));
  }
  ~FaultyConnections() override { expect_reference_film(farm_.client(), job_, picture_); }

  /// A job that ends before the faults gets more samples.
  void keep_busy() {
    FarmClient client = farm_.client();
    if (const v1::Job job = client.job(job_); job.samples_done() + kPixels * 150 > kPixels * picture_.samples) {
      picture_.samples += 250;
      client.extend(job_, picture_.samples);
    }
  }

  Farm farm_;
  std::array<std::unique_ptr<FaultProxy>, 2> proxies_;
  Picture picture_ = picture_of(500);
  std::uint64_t job_ = 0;
};

TEST_F(FaultyConnections, DelayedAndReorderedMessagesKeepTheBits) {
  for (const auto& proxy : proxies_) {
    proxy->delay(Way::there, milliseconds(0), milliseconds(120));
    proxy->delay(Way::back, milliseconds(0), milliseconds(120));
  }
  farm_.client().wait_while_it_works(job_, picture_, kPixels * 20);
}

TEST_F(FaultyConnections, RepeatedCutsKeepTheBits) {
  std::mt19937 random(20261122);
  for (int i = 0; i < 12; ++i) {
    keep_busy();
    farm_.client().wait_while_it_works(job_, picture_, random() % (kPixels * 20));
    proxies_[random() % 2]->cut();
  }
  EXPECT_TRUE(eventually([&] { return farm_.times_met("w1") > 1 && farm_.times_met("w2") > 1; }));
}

TEST_F(FaultyConnections, ALongCutKeepsTheBits) {
  for (const auto& proxy : proxies_) {
    keep_busy();
    proxy->refuse(true);
    proxy->cut();
    EXPECT_TRUE(eventually([&] { return proxy->times_refused() > 0; })) << "its worker retries";
    proxy->refuse(false);
  }
  EXPECT_TRUE(eventually([&] { return farm_.times_met("w1") > 1 && farm_.times_met("w2") > 1; }));
}

TEST_F(FaultyConnections, StallsInOneDirectionOrBothKeepTheBits) {
  const std::vector<std::vector<Way>> stalls = {{Way::there}, {Way::back}, {Way::there, Way::back}};
  const auto stored = [&] { return farm_.times_said("w1", " is stored by the coordinator"); };
  const auto stall = [&](const std::vector<Way>& ways, bool on) {
    for (const Way way : ways) {
      proxies_[0]->stall(way, on);
    }
  };
  for (const std::vector<Way>& ways : stalls) {
    keep_busy();
    stall(ways, true);
    farm_.client().wait_while_it_works(job_, picture_, kPixels * 20);  // by the other worker
    const int before = stored();
    stall(ways, false);
    EXPECT_TRUE(eventually([&] { return stored() > before; })) << "held messages arrive";
  }
  EXPECT_EQ(farm_.times_missed("w1"), 0) << "so short a stall ends no worker";
  for (const std::vector<Way>& ways : stalls) {
    keep_busy();
    const int before = farm_.times_missed("w1");
    EXPECT_TRUE(eventually([&] { return farm_.times_met("w1") > before; }));
    stall(ways, true);
    EXPECT_TRUE(eventually([&] { return farm_.times_missed("w1") > before; })) << farm_.server_log();
    stall(ways, false);
  }
  EXPECT_EQ(farm_.times_missed("w2"), 0);
}

TEST(StoppedProcesses, AStoppedWorkerIsReplacedAndComesBack) {
  Farm farm;
  Picture picture = picture_of(600);
  farm.add_worker(1, "w1");
  farm.add_worker(1, "w2");
  const std::uint64_t job = farm.client().submit(picture).id();
  farm.client().wait_for_samples(job, kPixels);
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  farm.worker("w1").send(SIGSTOP);
  const v1::Job done = farm.client().wait_until_ended(job);
  EXPECT_EQ(done.state(), v1::JOB_STATE_DONE) << "the other one finishes its units";
  EXPECT_TRUE(eventually([&] { return farm.missed("w1"); }));
  picture.samples = 900;
  farm.client().extend(job, picture.samples);
  farm.worker("w1").send(SIGCONT);
  expect_reference_film(farm.client(), job, picture);
  EXPECT_FALSE(farm.worker("w1").wait(milliseconds(0)));
}

TEST(StoppedProcesses, AStoppedCoordinatorResumes) {
  Farm farm;
  Picture picture = picture_of(300);
  farm.add_worker(1, "w1");
  farm.add_worker(1, "w2");
  const std::uint64_t job = farm.client().submit(picture).id();
  farm.client().wait_for_samples(job, kPixels);
  ASSERT_TRUE(eventually([&] { return farm.met("w1") && farm.met("w2"); }));
  farm.server().send(SIGSTOP);
  for (const char* const worker : {"w1", "w2"}) {
    EXPECT_TRUE(eventually([&] { return farm.times_said(worker, "no connection to ") > 0; }))
        << farm.worker_log(worker);
  }
  farm.server().send(SIGCONT);
  expect_reference_film(farm.client(), job, picture);
}

TEST(JumpingClocks, DoNotDisturbAFarm) {
  const MovableClock coordinators, workers;
  Farm farm({}, {"127.0.0.1", {}, coordinators.environment()});
  Picture picture = picture_of(300);
  farm.add_worker(1, "w1", {"", {}, workers.environment()});
  farm.add_worker(1, "w2");
  const std::uint64_t job = farm.client().submit(picture).id();
  for (const char* const offset : {"+400d", "-400d", "+0"}) {
    const std::uint64_t before = farm.client().job(job).samples_done();
    coordinators.move(offset);
    workers.move(offset[0] == '+' ? "-3h" : "+3h");
    farm.client().wait_for_samples(job, std::min(before + 80 * kPixels, picture.samples * kPixels));
  }
  expect_reference_film(farm.client(), job, picture);
  const v1::Job done = farm.client().job(job);
  EXPECT_GT(done.worker_seconds(), 0);
  EXPECT_LT(done.worker_seconds(), 3 * 3600) << "a jump of a worker's clock was counted";
}

}  // namespace
}  // namespace lightmill::test
