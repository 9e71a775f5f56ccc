// Inspections one after another, whatever happens to each.
#include "worker/inspect/inspector.h"

#include <gtest/gtest.h>

#include <deque>
#include <future>
#include <new>
#include <stdexcept>

namespace lightmill {
namespace {

const std::string kBall = R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "up": [0, 1, 0], "camera_constant": 1},
"materials": [{"name": "grey", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}}],
"objects": [{"name": "ball", "material": "grey", "sphere": {"center": [0, 0, 0], "radius": 1}}]})";

/// A clock that moves when the test says so.
class StepClock final : public Clock {
 public:
  Time now() const override { return Time(std::chrono::seconds(seconds_)); }
  std::int64_t unix_milliseconds() const override { return 0; }
  void pass(std::chrono::seconds time) { seconds_ += time.count(); }

 private:
  std::atomic<std::int64_t> seconds_ = 1000;
};

/// Fetches one file by its digest; the first fetch of a digest in `held` waits for its gate.
class InspectorTest : public ::testing::Test {
 protected:
  ~InspectorTest() override { open_.store(true); }

  Result<std::string> fetch(const Sha256& digest) {
    if (digest == sha256("no memory")) {
      throw std::bad_alloc();
    }
    if (digest == sha256("strange")) {
      throw std::length_error("too long");
    }
    if (digest == sha256("held")) {
      held_.set_value();
      while (!open_) {
        std::this_thread::yield();
      }
      return std::string("held");
    }
    if (digest == sha256(kBall + "\n")) {
      clock_.pass(std::chrono::seconds(61));
      return kBall + "\n";
    }
    return digest == sha256(kBall) ? Result<std::string>(kBall) : not_found("there is no such asset");
  }
  static std::shared_ptr<const InspectGrant> grant(std::uint64_t id, const std::string& bytes) {
    return std::make_shared<const InspectGrant>(
        InspectGrant{InspectionId{id}, std::make_shared<const InspectionRequest>(
                                           InspectionRequest{{{"scene.json", sha256(bytes)}}, {"scene.json"}, ""})});
  }
  InspectReport next_report() {
    const MutexLock lock(mutex_);
    while (reports_.empty()) {
      changed_.wait(mutex_);
    }
    InspectReport report = std::move(reports_.front());
    reports_.pop_front();
    return report;
  }
  std::size_t reports() const {
    const MutexLock lock(mutex_);
    return reports_.size();
  }

  std::atomic<bool> open_ = false, slow_upload_ = false;
  StepClock clock_;
  std::promise<void> held_;
  mutable Mutex mutex_;
  CondVar changed_;
  std::deque<InspectReport> reports_ LM_GUARDED_BY(mutex_);
  AssetCache assets_{[this](const Sha256& digest) { return fetch(digest); }, 1 << 20};
  Inspector inspector_{assets_,
                       SceneLimits{},
                       DecoderOptions{},
                       [this](const auto&, const auto& may_continue) {
                         clock_.pass(std::chrono::seconds(slow_upload_ ? 61 : 0));
                         return may_continue();
                       },
                       [this](InspectReport report) {
                         const MutexLock lock(mutex_);
                         reports_.push_back(std::move(report));
                         changed_.notify_one();
                       },
                       clock_};
};

TEST_F(InspectorTest, EachInspectionReportsItsFindings) {
  inspector_.add(grant(1, kBall));
  const InspectReport found = next_report();
  EXPECT_EQ(found.inspection, InspectionId{1});
  ASSERT_TRUE(found.found.ok()) << found.found.status();
  EXPECT_FALSE((*found.found)->scene.empty());
  inspector_.add(grant(2, "missing"));
  const InspectReport missing = next_report();
  EXPECT_EQ(missing.inspection, InspectionId{2});
  EXPECT_FALSE(missing.found.ok());
}

TEST_F(InspectorTest, SurvivesOutOfMemoryAndExceptions) {
  inspector_.add(grant(1, "no memory"));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kResourceExhausted);
  inspector_.add(grant(2, kBall));
  EXPECT_TRUE(next_report().found.ok());
  inspector_.add(grant(3, "strange"));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kInternal);
  inspector_.add(grant(4, kBall));
  EXPECT_TRUE(next_report().found.ok());
}

TEST_F(InspectorTest, ANewInspectionReplacesTheRunningOne) {
  inspector_.add(grant(1, "held"));
  held_.get_future().wait();
  inspector_.add(grant(2, kBall));
  open_ = true;
  EXPECT_EQ(next_report().inspection, InspectionId{2}) << "the first was replaced";
}

TEST_F(InspectorTest, AnInspectionTimesOutAfterAMinute) {
  inspector_.add(grant(1, kBall + "\n"));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kDeadlineExceeded);
  slow_upload_ = true;
  inspector_.add(grant(2, kBall));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kDeadlineExceeded);
  slow_upload_ = false;
  inspector_.add(grant(3, kBall));
  const InspectReport report = next_report();
  EXPECT_TRUE(report.found.ok()) << report.found.status();
}

TEST_F(InspectorTest, ADroppedInspectionIsNotReported) {
  inspector_.add(grant(1, "held"));
  held_.get_future().wait();
  inspector_.drop();
  open_ = true;
  inspector_.add(grant(2, kBall));
  EXPECT_EQ(next_report().inspection, InspectionId{2});
  EXPECT_EQ(reports(), 0u);
}

}  // namespace
}  // namespace lightmill
