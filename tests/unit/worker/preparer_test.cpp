// The thread that makes jobs ready and runs pilots.
#include "worker/render/preparer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "common/wire/scene_proto.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

class PreparerTest : public ::testing::Test {
 protected:
  PreparerTest() {
    settings_.scene = pack_scene(scene_.scene());
    settings_.width = 96;
    settings_.height = 80;
    settings_.crop = {0, 0, 96, 80};
    settings_.renderer_version = kRendererVersion;
  }
  std::shared_ptr<const PilotGrant> pilot(std::uint64_t lease, std::size_t methods = 2) const {
    return std::make_shared<PilotGrant>(
        PilotGrant{LeaseId{lease}, JobId{lease}, settings_, std::vector<std::string>(methods, "path")});
  }
  /// Would take an hour.
  std::shared_ptr<const PilotGrant> endless(std::uint64_t lease) const { return pilot(lease, 100'000); }
  std::shared_ptr<const JobDescription> job(std::uint64_t id) const {
    return std::make_shared<JobDescription>(JobDescription{JobId{id}, {}, settings_});
  }
  std::unique_ptr<Preparer> make() {
    return std::make_unique<Preparer>(
        assets_, SceneCacheLimits{},
        [this](std::shared_ptr<const JobDescription> description, Result<PreparedJob> prepared) {
          const MutexLock lock(mutex_);
          EXPECT_TRUE(prepared.ok()) << prepared.status();
          prepared_.push_back(std::move(description));
          changed_.notify_one();
        },
        [this](LeaseId lease, Result<PilotReport> report) {
          const MutexLock lock(mutex_);
          EXPECT_TRUE(report.ok()) << report.status();
          reported_.push_back(lease);
          changed_.notify_one();
        });
  }
  void wait_for_report() {
    const MutexLock lock(mutex_);
    while (reported_.empty()) {
      changed_.wait(mutex_);
    }
  }

  const test::TestScene scene_ =
      test::TestScene(LIGHTMILL_SOURCE_DIR "/scenes/cornell-bench-balls.json").resized(96, 80);
  RenderSettings settings_;
  AssetCache assets_{scene_.assets(), 1 << 20};
  Mutex mutex_;
  CondVar changed_;
  std::vector<LeaseId> reported_;
  std::vector<std::shared_ptr<const JobDescription>> prepared_;
};

TEST_F(PreparerTest, DroppedPilotsAreStoppedAndNotReported) {
  const std::unique_ptr<Preparer> preparer = make();
  preparer->add(endless(1));
  preparer->add(endless(2));
  preparer->add(pilot(3));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // by now the first may be under way
  preparer->drop(LeaseId{1});
  preparer->drop(LeaseId{2});
  wait_for_report();
  EXPECT_EQ(reported_, std::vector<LeaseId>{LeaseId{3}});
}

TEST_F(PreparerTest, OnlyTheLastDescriptionOfAJobIsPrepared) {
  const std::unique_ptr<Preparer> preparer = make();
  preparer->add(endless(1));
  const std::shared_ptr<const JobDescription> last = job(7);
  preparer->add(job(7));
  preparer->add(job(8));
  preparer->add(job(7));
  preparer->add(last);
  preparer->drop(JobId{8});
  preparer->add(pilot(2));
  preparer->drop(LeaseId{1});
  wait_for_report();
  ASSERT_EQ(prepared_.size(), 1u);
  EXPECT_EQ(prepared_[0], last);
}

TEST_F(PreparerTest, ItsEndWaitsForNoPilot) {
  std::unique_ptr<Preparer> preparer = make();
  preparer->add(endless(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  preparer.reset();
  EXPECT_TRUE(reported_.empty());
}

}  // namespace
}  // namespace lightmill
