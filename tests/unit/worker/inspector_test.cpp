// Inspections one after another, whatever happens to each.
#include "worker/inspect/inspector.h"

#include <gtest/gtest.h>

#include <deque>
#include <fstream>
#include <future>
#include <new>
#include <regex>
#include <stdexcept>

#include "common/base/file.h"
#include "common/base/sanitizers.h"
#include "tests/support/paths.h"
#include "tests/support/step_clock.h"
#include "tests/support/temporary_folder.h"
#include "worker/inspect/scene_reader.h"

namespace lightmill {
namespace {

const std::string kBall = R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "up": [0, 1, 0], "camera_constant": 1},
"materials": [{"name": "grey", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}}],
"objects": [{"name": "ball", "material": "grey", "sphere": {"center": [0, 0, 0], "radius": 1}}]})";

/// Fetches one file by its digest; the first fetch of a digest in `held` waits for its gate.
class InspectorTest : public ::testing::Test {
 protected:
  InspectorTest() { use_reader(reader_, SceneLimits{}); }
  ~InspectorTest() override {
    open_.store(true);
    inspector_.reset();
  }

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
    if (digest == sha256(large_)) {
      return large_;
    }
    return digest == sha256(kBall) ? Result<std::string>(kBall) : not_found("there is no such asset");
  }
  static std::shared_ptr<const InspectGrant> grant(std::uint64_t id, const std::string& bytes,
                                                   const std::string& name = "scene.json") {
    return std::make_shared<const InspectGrant>(InspectGrant{
        InspectionId{id},
        std::make_shared<const InspectionRequest>(InspectionRequest{{{name, sha256(bytes)}}, {name}, ""})});
  }
  /// Uses a shell script as the scene reader from now on.
  void use_reader(const std::string& script) {
    const std::filesystem::path program = folder_.path() / "reader";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    use_reader(ReaderOptions{.program = program}, SceneLimits{});
  }
  void use_reader(const ReaderOptions& reader, const SceneLimits& limits) {
    inspector_.reset();  // ends the one before
    inspector_ = std::make_unique<Inspector>(
        assets_, limits, reader,
        AssetUploads{[this](std::span<const Sha256>) -> Result<std::vector<Sha256>> {
                       clock_.pass(std::chrono::seconds(slow_upload_ ? 61 : 0));
                       return std::vector<Sha256>();
                     },
                     [](const Sha256&, ByteView) { return ok_status(); }},
        [this](InspectReport report) {
          const MutexLock lock(mutex_);
          reports_.push_back(std::move(report));
          changed_.notify_one();
        },
        clock_);
  }
  /// The id that a script of use_reader wrote into the file `pid`.
  pid_t reader_pid() const {
    pid_t pid = 0;
    while (!(std::ifstream(folder_.path() / "pid") >> pid)) {
      std::this_thread::yield();
    }
    return pid;
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
  test::StepClock clock_;
  std::promise<void> held_;
  mutable Mutex mutex_;
  CondVar changed_;
  std::deque<InspectReport> reports_ LM_GUARDED_BY(mutex_);
  AssetCache assets_{[this](const Sha256& digest) { return fetch(digest); }, 1 << 20};
  std::string large_;  ///< another file; set it before the inspection
  const test::TemporaryFolder folder_;
  const ReaderOptions reader_{.program = test::program("lightmill-worker")};
  std::unique_ptr<Inspector> inspector_;
};

TEST_F(InspectorTest, EachInspectionReportsItsFindings) {
  inspector_->add(grant(1, kBall));
  const InspectReport found = next_report();
  EXPECT_EQ(found.inspection, InspectionId{1});
  ASSERT_TRUE(found.found.ok()) << found.found.status();
  EXPECT_FALSE((*found.found)->scene.empty());
  inspector_->add(grant(2, "missing"));
  const InspectReport missing = next_report();
  EXPECT_EQ(missing.inspection, InspectionId{2});
  EXPECT_FALSE(missing.found.ok());
}

TEST_F(InspectorTest, SurvivesOutOfMemoryAndExceptions) {
  inspector_->add(grant(1, "no memory"));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kResourceExhausted);
  inspector_->add(grant(2, kBall));
  EXPECT_TRUE(next_report().found.ok());
  inspector_->add(grant(3, "strange"));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kInternal);
  inspector_->add(grant(4, kBall));
  EXPECT_TRUE(next_report().found.ok());
}

TEST_F(InspectorTest, ANewInspectionReplacesTheRunningOne) {
  inspector_->add(grant(1, "held"));
  held_.get_future().wait();
  inspector_->add(grant(2, kBall));
  open_ = true;
  EXPECT_EQ(next_report().inspection, InspectionId{2}) << "the first was replaced";
}

TEST_F(InspectorTest, AnInspectionTimesOutAfterAMinute) {
  inspector_->add(grant(1, kBall + "\n"));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kDeadlineExceeded);
  slow_upload_ = true;
  inspector_->add(grant(2, kBall));
  EXPECT_EQ(next_report().found.status().code(), StatusCode::kDeadlineExceeded);
  slow_upload_ = false;
  inspector_->add(grant(3, kBall));
  const InspectReport report = next_report();
  EXPECT_TRUE(report.found.ok()) << report.found.status();
}

TEST_F(InspectorTest, AReaderThatHangsIsKilledAfterAMinute) {
  use_reader("echo $$ > " + (folder_.path() / "pid").string() + "\nexec sleep 1000");
  inspector_->add(grant(1, kBall));
  const pid_t pid = reader_pid();
  clock_.pass(std::chrono::seconds(61));
  const Status status = next_report().found.status();
  EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_NE(message_of(status).find("reading the scene takes more than 60 s"), std::string::npos) << status;
  EXPECT_EQ(::kill(pid, 0), -1) << "the reader is gone";
}

TEST_F(InspectorTest, ADroppedInspectionAndAnEndDoNotWaitForTheReader) {
  use_reader("echo $$ > " + (folder_.path() / "pid").string() + "\nexec sleep 1000");
  inspector_->add(grant(1, kBall));
  const pid_t dropped = reader_pid();
  inspector_->drop();
  while (::kill(dropped, 0) == 0) {
    std::this_thread::yield();
  }
  std::filesystem::remove(folder_.path() / "pid");
  inspector_->add(grant(2, kBall));
  const pid_t ended = reader_pid();
  inspector_.reset();
  EXPECT_EQ(::kill(ended, 0), -1);
  EXPECT_EQ(reports(), 0u);
}

/// The contents of a file of the process that this one has started as a scene reader.
std::string file_of_reader(const char* name) {
  const std::string parent = fmt::format("PPid:\t{}\n", ::getpid());
  for (const auto& folder : std::filesystem::directory_iterator("/proc")) {
    if (const Result<std::string> status = read_file(folder.path() / "status");
        status.ok() && status->find(parent) != std::string::npos &&
        read_file(folder.path() / "cmdline").value_or("").find(kSceneReaderOption) != std::string::npos) {
      return read_file(folder.path() / name).value_or("");
    }
  }
  return "";
}

TEST_F(InspectorTest, AReaderHasLimitsAndNoSecrets) {
  ::setenv("LIGHTMILL_TOKEN", "secret", 1);
  inspector_->add(grant(1, "held"));
  held_.get_future().wait();
  const std::string limits = file_of_reader("limits"), environment = file_of_reader("environ");
  EXPECT_EQ(file_of_reader("oom_score_adj"), "1000\n");
  open_ = true;
  next_report();
  ::unsetenv("LIGHTMILL_TOKEN");
  const auto has = [&](const char* pattern) { return std::regex_search(limits, std::regex(pattern)); };
  EXPECT_TRUE(has("Max cpu time +60 +65 ")) << limits;
  EXPECT_TRUE(has("Max core file size +0 +0 ")) << limits;
  EXPECT_TRUE(kSanitized || has("Max data size +[0-9]+ +[0-9]+ ")) << limits;
  EXPECT_EQ(environment.find("LIGHTMILL_TOKEN"), std::string::npos) << environment;
}

TEST_F(InspectorTest, AReaderThatEndsEarlyIsNamedAndTheNextSceneIsRead) {
  use_reader("kill -SEGV $$");
  inspector_->add(grant(1, kBall));
  Status status = next_report().found.status();
  EXPECT_EQ(status.code(), StatusCode::kInternal);
  EXPECT_NE(message_of(status).find("ended early (signal 11, "), std::string::npos) << status;
  std::uint64_t id = 1;
  for (const auto& [script, code] : {std::pair{"kill -KILL $$", StatusCode::kResourceExhausted},
                                     {"exit 3", StatusCode::kResourceExhausted},
                                     {"ulimit -S -t 1; while :; do :; done", StatusCode::kDeadlineExceeded},
                                     {"head -c 100000 /dev/zero >&0", StatusCode::kInternal}}) {
    use_reader(script);
    inspector_->add(grant(++id, kBall));
    EXPECT_EQ(next_report().found.status().code(), code) << script;
  }
  use_reader(ReaderOptions{.program = folder_.path() / "none"}, SceneLimits{});
  inspector_->add(grant(++id, kBall));
  status = next_report().found.status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(status).find("cannot read scenes: cannot start "), std::string::npos) << status;
  use_reader(reader_, SceneLimits{});
  inspector_->add(grant(++id, kBall));
  EXPECT_TRUE(next_report().found.ok());
}

// Each file is within the limit of bytes, and takes 20 times as much memory.
TEST_F(InspectorTest, FilesThatNeedTooMuchMemoryAreRefusedByName) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers need more address space than any limit allows";
  }
  SceneLimits limits;
  limits.bytes = std::uint64_t{192} << 20;
  use_reader(reader_, limits);
  std::string values = R"({"asset": {"version": "2.0"}, "extras": [{})", materials = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  while (values.size() < (20u << 20)) {
    values += ",{}";
  }
  for (int i = 0; materials.size() < (20u << 20); ++i) {
    materials += fmt::format("usemtl {}\nf 1 2 3\n", i);
  }
  std::uint64_t id = 0;
  for (const auto& [name, bytes] : {std::pair{"scene.gltf", values + "]}"}, {"scene.obj", materials}}) {
    large_ = bytes;
    inspector_->add(grant(++id, large_, name));
    const Status status = next_report().found.status();
    EXPECT_EQ(status.code(), StatusCode::kResourceExhausted) << name << ": " << status;
    EXPECT_NE(message_of(status).find("reading the scene takes more than 128 MiB of memory"), std::string::npos)
        << name << ": " << status;
    inspector_->add(grant(++id, kBall));
    EXPECT_TRUE(next_report().found.ok());
  }
}

TEST_F(InspectorTest, ADroppedInspectionIsNotReported) {
  inspector_->add(grant(1, "held"));
  held_.get_future().wait();
  inspector_->drop();
  open_ = true;
  inspector_->add(grant(2, kBall));
  EXPECT_EQ(next_report().inspection, InspectionId{2});
  EXPECT_EQ(reports(), 0u);
}

}  // namespace
}  // namespace lightmill
