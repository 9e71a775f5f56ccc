// The table of operations: its statements about each, and the course of a call.
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <future>
#include <map>

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "server/operations/changes.h"
#include "server/operations/handlers.h"
#include "server/operations/operation_call.h"
#include "server/store/asset_folder.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

TEST(Operations, EachUnaryMethodIsOneEntryWithItsMessages) {
  std::map<std::string_view, int> entries;
  for (const Operation& operation : operations()) {
    entries[operation.rpc.method] += operation.traits.http_only ? 0 : 1;
  }
  for (const Rpc& rpc : served_rpcs()) {
    const auto* const service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(std::string(rpc.service));
    if (service == nullptr) {
      continue;  // one with streams alone, whose messages nothing here uses
    }
    const auto* const method = service->FindMethodByName(std::string(rpc.method));
    ASSERT_NE(method, nullptr) << rpc.method;
    const bool streams = method->client_streaming() || method->server_streaming();
    EXPECT_EQ(entries[rpc.method], streams ? 0 : 1) << rpc.method;
    if (const Operation* const operation = find_operation(rpc.method)) {
      EXPECT_EQ(operation->handler.request->GetDescriptor(), method->input_type()) << rpc.method;
      EXPECT_EQ(operation->handler.reply->GetDescriptor(), method->output_type()) << rpc.method;
    }
  }
}

TEST(Operations, CallsAboutJobsCheckTheOwner) {
  for (const Operation& operation : operations()) {
    const Right right = operation.rpc.right;
    EXPECT_EQ(operation.handler.of_job, right == Right::see_job || right == Right::control_job) << operation.http;
  }
}

TEST(Operations, ChangesAreTheValuesThatDiffer) {
  JobStatus before;
  before.state = JobState::done;
  before.spec.priority = -2;
  before.spec.goal = {64, 0.5, 0, false};
  EXPECT_EQ(describe_change(before, &before), "");
  JobStatus after = before;
  after.state = JobState::running;
  after.spec.priority = 10;
  after.spec.goal = {128, 0, 0.001, false};
  EXPECT_EQ(describe_change(before, &after),
            "state done -> running, priority -2 -> 10, samples 64 -> 128, seconds 0.5 -> none, error none -> 0.001");
  after = before;
  after.spec.goal.samples = 0;
  EXPECT_EQ(describe_change(before, &after), "samples 64 -> none");
  EXPECT_EQ(describe_change(before, nullptr), "state done -> deleted");
  const WorkerStatus free;
  WorkerStatus stopped;
  stopped.draining = true;
  stopped.quarantine = "put there by ada: noise";
  EXPECT_EQ(describe_change(free, free), "");
  EXPECT_EQ(describe_change(free, stopped), "draining no -> yes, quarantine none -> 'put there by ada: noise'");
  EXPECT_EQ(describe_change(stopped, free), "draining yes -> no, quarantine 'put there by ada: noise' -> none");
}

/// A store that keeps nothing, and holds each commit until it is released.
class SlowStore final : public Store {
 public:
  explicit SlowStore(std::shared_future<void> let) : let_(std::move(let)) {}
  Result<StoredState> load() override { return StoredState{}; }
  Result<FilmPiece> read_film(JobId, const FilmPosition&) override { return FilmPiece{}; }
  Status check_structure() override { return ok_status(); }
  Status commit(std::span<const StoreOp>) override {
    let_.wait();
    return ok_status();
  }

 private:
  const std::shared_future<void> let_;
};

class OperationCallTest : public ::testing::Test {
 protected:
  ~OperationCallTest() override {
    if (!let_) {
      let.set_value();
    }
    EXPECT_TRUE(runtime->stop().ok());
  }
  void let_commits() {
    let_ = true;
    let.set_value();
  }

  /// Starts the call; its answer comes later.
  std::future<Status> start(const std::shared_ptr<OperationCall>& asked, const Identity& caller) {
    const auto answer = std::make_shared<std::promise<Status>>();
    asked->start({caller, asked->operation().rpc, "10.0.0.7:4711"},
                 [answer](const Status& done) { answer->set_value(done); });
    return answer->get_future();
  }
  std::shared_ptr<OperationCall> call(std::string_view method) {
    return std::make_shared<OperationCall>(*runtime, *find_operation(method));
  }
  void on_farm(const FarmLoop::Task& task) {
    std::promise<void> done;
    runtime->loop().post_always([&](FarmLoop::TaskContext& context) {
      task(context);
      done.set_value();
    });
    done.get_future().wait();
  }
  static JobSpec job_of(const std::string& owner) {
    JobSpec spec;
    spec.request_id = "one";
    spec.name = "cornell";
    spec.owner = owner;
    spec.settings.width = spec.settings.height = 64;
    spec.settings.crop = {0, 0, 64, 64};
    spec.settings.renderer_version = kRendererVersion;
    Scene scene;
    scene.materials.emplace_back().name = "grey";
    scene.objects.push_back({"ball", 0, SphereShape{{0, 0, 0}, 1}});
    spec.settings.scene = pack_scene(scene);
    spec.goal.samples = 4;
    return spec;
  }
  JobId submit(const std::string& owner) {
    JobId job;
    on_farm([&](FarmLoop::TaskContext& context) {
      job = context.farm.submit(job_of(owner), context.now, context.unix_ms, context.effects).value();
    });
    return job;
  }
  std::vector<Action> actions() {
    std::vector<Action> found;
    on_farm([&](FarmLoop::TaskContext& context) { found = context.actions.find({}, 10).actions; });
    return found;
  }
  static RuntimeOptions keeping_jobs_for(Duration time) {
    RuntimeOptions options;
    options.limits.keep_ended = time;
    options.access.calls.requests_per_second = 1;
    return options;
  }
  static Identity user(const std::string& name) { return {name, {Role::submit}, Proof::token, 0, ""}; }

  TemporaryFolder folder;
  std::promise<void> let;
  bool let_ = false;
  std::unique_ptr<Runtime> runtime =
      Runtime::start(std::make_unique<SlowStore>(let.get_future().share()),
                     open_asset_folder(folder.path(), {std::uint64_t{1} << 20, std::uint64_t{1} << 20}).value(),
                     keeping_jobs_for(std::chrono::hours(24)))
          .value();
};

TEST_F(OperationCallTest, AChangeIsRecordedAndAnsweredAfterItsCommit) {
  const JobId job = submit("ada");
  const auto asked = call("PauseJob");
  static_cast<v1::PauseJobRequest&>(asked->request()).set_id(job.value);
  EXPECT_EQ(asked->about().job, job.value);
  std::future<Status> answer = start(asked, user("ada"));
  on_farm([&](FarmLoop::TaskContext& context) {
    EXPECT_EQ(context.farm.status(job, context.now)->state, JobState::paused);
  });
  EXPECT_EQ(answer.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  let_commits();
  EXPECT_TRUE(answer.get().ok());
  EXPECT_EQ(static_cast<const v1::Job&>(asked->reply()).state(), v1::JOB_STATE_PAUSED);
  const std::vector<Action> log = actions();
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0].operation, "PauseJob");
  EXPECT_EQ(log[0].caller, "ada");
  EXPECT_EQ(log[0].job, job.value);
  EXPECT_EQ(log[0].about, "cornell");
  EXPECT_EQ(log[0].change, "state queued -> paused");
}

TEST_F(OperationCallTest, AnEndIsShownOnceItIsStored) {
  const JobId job = submit("ada");
  const auto seen = [&] {
    const auto asked = call("GetJob");
    static_cast<v1::GetJobRequest&>(asked->request()).set_id(job.value);
    EXPECT_TRUE(start(asked, user("ada")).get().ok());
    return static_cast<const v1::Job&>(asked->reply()).state();
  };
  const auto listed = [&](v1::JobState state) {
    const auto asked = call("ListJobs");
    static_cast<v1::ListJobsRequest&>(asked->request()).add_states(state);
    EXPECT_TRUE(start(asked, user("ada")).get().ok());
    return static_cast<const v1::ListJobsResponse&>(asked->reply()).jobs_size();
  };
  const auto asked = call("CancelJob");
  static_cast<v1::CancelJobRequest&>(asked->request()).set_id(job.value);
  std::future<Status> answer = start(asked, user("ada"));
  EXPECT_EQ(seen(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(listed(v1::JOB_STATE_QUEUED), 1);
  EXPECT_EQ(listed(v1::JOB_STATE_CANCELLED), 0);
  let_commits();
  EXPECT_TRUE(answer.get().ok());
  EXPECT_EQ(static_cast<const v1::Job&>(asked->reply()).state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(seen(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(listed(v1::JOB_STATE_QUEUED), 0);
  EXPECT_EQ(listed(v1::JOB_STATE_CANCELLED), 1);
  EXPECT_EQ(actions().at(0).change, "state queued -> cancelled");
}

TEST_F(OperationCallTest, ACallAboutAnotherUsersJobIsRefusedAndRecorded) {
  const JobId job = submit("ada");
  const auto asked = call("PauseJob");
  static_cast<v1::PauseJobRequest&>(asked->request()).set_id(job.value);
  EXPECT_EQ(start(asked, user("eve")).get().code(), StatusCode::kPermissionDenied);
  on_farm([&](FarmLoop::TaskContext& context) {
    EXPECT_EQ(context.farm.status(job, context.now)->state, JobState::queued);
  });
  const std::vector<Action> log = actions();
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0].caller, "eve");
  EXPECT_EQ(log[0].outcome, StatusCode::kPermissionDenied);
  EXPECT_EQ(log[0].change, "");
}

TEST_F(OperationCallTest, AJobThatIsDeletedAfterADayIsRecorded) {
  constexpr std::int64_t kDayMs = 86'400'000;
  on_farm([&](FarmLoop::TaskContext& context) {
    const JobId job = context.farm.submit(job_of("ada"), context.now, context.unix_ms, context.effects).value();
    EXPECT_TRUE(context.farm.cancel(job, context.now, context.unix_ms - kDayMs, context.effects).ok());
  });
  const std::vector<Action> log = actions();
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0].operation, "ExpireJob");
  EXPECT_EQ(log[0].about, "cornell");
  EXPECT_EQ(log[0].change, "deleted: --keep-days after its end");
}

TEST_F(OperationCallTest, AnInvalidCallLeavesNoRecord) {
  const auto asked = call("PauseJob");
  static_cast<v1::PauseJobRequest&>(asked->request()).set_id(7);
  EXPECT_EQ(start(asked, anonymous_identity()).get().code(), StatusCode::kNotFound);
  EXPECT_TRUE(actions().empty());
}

TEST_F(OperationCallTest, AWorkersHistoryHasItsMinutes) {
  on_farm([](FarmLoop::TaskContext& context) {
    for (int i = 0; i < 7; ++i) {  // the first may be a moment, and no interval yet
      context.activity.history.add({.workers = {{"box", 1, 1, 5, 2, 700}}}, context.now + i * FarmHistory::kInterval,
                                   60'000);
    }
  });
  const auto operation = std::ranges::find(operations(), "GET workers/{name}/history", &Operation::http);
  ASSERT_NE(operation, operations().end());
  const auto asked = std::make_shared<OperationCall>(*runtime, *operation);
  static_cast<v1::WorkerHistoryRequest&>(asked->request()).set_name("box");
  EXPECT_TRUE(start(asked, user("ada")).get().ok());
  const auto& history = static_cast<const v1::WorkerHistory&>(asked->reply());
  ASSERT_EQ(history.minutes_size(), 1);
  EXPECT_EQ(history.minutes(0).unix_ms(), 60'000);
  EXPECT_GE(history.minutes(0).seconds(), 50);
  EXPECT_EQ(history.minutes(0).results(), 5u);
  EXPECT_EQ(history.minutes(0).leases_lost(), 2u);
  EXPECT_EQ(history.minutes(0).pixel_samples(), 700);
}

TEST_F(OperationCallTest, TheListOfWorkersSaysWhyAllWorkIsHeld) {
  const auto notices = [&] {
    const auto asked = call("ListWorkers");
    EXPECT_TRUE(start(asked, user("ada")).get().ok());
    const auto& found = static_cast<const v1::ListWorkersResponse&>(asked->reply()).notices();
    return std::vector<std::string>(found.begin(), found.end());
  };
  EXPECT_EQ(notices(), std::vector<std::string>{});
  runtime->loop().set_space("waits for space: the disk is full");
  EXPECT_EQ(notices(), std::vector<std::string>{"all work waits for space: the disk is full"});
  runtime->loop().set_space("");
  EXPECT_EQ(notices(), std::vector<std::string>{});
}

TEST_F(OperationCallTest, AFullDiskTakesNoNewJobs) {
  let_commits();
  const auto submitted = [&](const std::string& request) {
    const auto asked = call("SubmitJob");
    JobSpec spec = job_of("ada");
    spec.request_id = request;
    to_wire(spec, &static_cast<v1::SubmitJobRequest&>(asked->request()));
    return start(asked, user("ada")).get();
  };
  EXPECT_TRUE(submitted("before").ok());
  runtime->loop().set_space("waits for space: the disk is full");
  const Status refused = submitted("meanwhile");
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(refused), "the farm takes no new jobs: it waits for space: the disk is full");
  EXPECT_TRUE(submitted("before").ok()) << "it is there";
  runtime->loop().set_space("");
  EXPECT_TRUE(submitted("meanwhile").ok());
}

TEST_F(OperationCallTest, AJobsAssetsCountForItsOwner) {
  let_commits();
  const auto send = [&](const std::string& user, const std::string& bytes) {
    const auto upload = runtime->assets().start_upload(sha256(bytes), user).value();
    return upload->append(as_byte_view(bytes)).ok() && upload->finish().ok();
  };
  const std::string worker(kUploadsOfWorkers), texture(400'000, 't'), other(90'000, 'o');
  const auto submitted = [&](const std::string& asset) {
    const auto asked = call("SubmitJob");
    JobSpec spec = job_of("ada");
    spec.settings.assets = {sha256(asset)};
    spec.request_id = spec.settings.assets->front().hex();
    to_wire(spec, &static_cast<v1::SubmitJobRequest&>(asked->request()));
    return start(asked, user("ada")).get();
  };
  EXPECT_EQ(submitted(texture).code(), StatusCode::kFailedPrecondition) << "it is missing";
  ASSERT_TRUE(send(worker, texture));
  EXPECT_FALSE(send(worker, std::string(150'000, 'w'))) << "workers may have half of a user's";
  EXPECT_TRUE(submitted(texture).ok());
  EXPECT_TRUE(send(worker, other));
  ASSERT_TRUE(send("ada", std::string(550'000, 'a')));
  const Status refused = submitted(other);
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(refused).substr(0, 55), "the assets of 'ada' would exceed their limit of 1048576");
}

TEST_F(OperationCallTest, UsersCannotRaiseAPriorityAboveTheLimit) {
  let_commits();
  const auto submitted = [&](const Identity& by, std::int32_t priority) {
    const auto asked = call("SubmitJob");
    JobSpec spec = job_of("ada");
    spec.request_id = fmt::format("{} {}", by.name, priority);
    spec.priority = priority;
    to_wire(spec, &static_cast<v1::SubmitJobRequest&>(asked->request()));
    return start(asked, by).get().code();
  };
  const Identity operating{"olga", {Role::submit, Role::operate}, Proof::token, 0, ""};
  EXPECT_EQ(submitted(user("ada"), 10), StatusCode::kOk);
  EXPECT_EQ(submitted(user("ada"), 11), StatusCode::kPermissionDenied);
  EXPECT_EQ(submitted(operating, 11), StatusCode::kOk);
  EXPECT_EQ(submitted(anonymous_identity(), 11), StatusCode::kOk) << "without authentication";
  const auto changed = [&](const Identity& by, std::int32_t priority) {
    const auto asked = call("SetPriority");
    auto& request = static_cast<v1::SetPriorityRequest&>(asked->request());
    request.set_id(1);
    request.set_priority(priority);
    return start(asked, by).get().code();
  };
  EXPECT_EQ(changed(user("ada"), -3), StatusCode::kOk);
  EXPECT_EQ(changed(user("ada"), 11), StatusCode::kPermissionDenied);
  EXPECT_EQ(changed(operating, 11), StatusCode::kOk);
}

TEST_F(OperationCallTest, RequestsThatWaitHaveALimitOfBytes) {
  std::promise<void> begun, release;
  runtime->loop().post_always([&](FarmLoop::TaskContext&) {
    begun.set_value();
    release.get_future().wait();
  });
  begun.get_future().wait();
  const auto post = [&](std::uint64_t bytes) { return runtime->loop().post([](FarmLoop::TaskContext&) {}, bytes); };
  EXPECT_TRUE(post(FarmLoop::kMaxTaskBytes - 1));
  EXPECT_TRUE(post(1));
  EXPECT_FALSE(post(1));
  EXPECT_TRUE(post(0));
  release.set_value();
  on_farm([](FarmLoop::TaskContext&) {});
  EXPECT_TRUE(post(FarmLoop::kMaxTaskBytes + 1)) << "alone, it may have any size";
}

TEST_F(OperationCallTest, TheEntriesOfAListCountAsRequests) {
  on_farm([&](FarmLoop::TaskContext& context) {
    for (int i = 0; i < 100; ++i) {
      JobSpec spec = job_of("ada");
      spec.request_id = fmt::format("request {}", i);
      ASSERT_TRUE(context.farm.submit(spec, context.now, context.unix_ms, context.effects).ok());
    }
  });
  const auto may_call = [&](const Identity& who) { return runtime->access().take_request(who, "10.0.0.7:4711").ok(); };
  EXPECT_TRUE(may_call(user("ada")));
  for (int i = 0; i < 20; ++i) {  // as 40 requests of a caller that may send 10 at once and one a second
    const auto asked = call("ListJobs");
    ASSERT_TRUE(start(asked, user("ada")).get().ok());
    ASSERT_EQ(static_cast<const v1::ListJobsResponse&>(asked->reply()).jobs_size(), 100);
  }
  EXPECT_FALSE(may_call(user("ada")));
  EXPECT_TRUE(may_call(user("bob")));
}

TEST_F(OperationCallTest, TheOtherAssetsOfAJobWithADamagedAssetAreChecked) {
  const std::vector<std::string> names{"one", "two", "three", "four"};
  for (const std::string& name : names) {
    const auto upload = runtime->assets().start_upload(sha256(name)).value();
    ASSERT_TRUE(upload->append(as_byte_view(name)).ok());
    ASSERT_TRUE(upload->finish().ok());
    const std::string hex = sha256(name).hex();
    if (name != "three") {
      std::ofstream(folder.path() / hex.substr(0, 2) / hex.substr(2)) << "damaged";
    }
  }
  const auto has = [&](const std::string& name) { return runtime->assets().has(sha256(name)); };
  on_farm([&](FarmLoop::TaskContext& context) {
    JobSpec spec = job_of("ada");
    spec.settings.assets = {sha256("one"), sha256("two"), sha256("three")};
    ASSERT_TRUE(context.farm.submit(spec, context.now, context.unix_ms, context.effects).ok());
    spec.request_id = "another";
    spec.settings.assets = {sha256("four")};
    ASSERT_TRUE(context.farm.submit(spec, context.now, context.unix_ms, context.effects).ok());
    EXPECT_EQ(context.farm.assets(sha256("one")), (std::set{sha256("one"), sha256("two"), sha256("three")}));
  });
  runtime->check_assets_of_same_jobs(sha256("one"));
  EXPECT_TRUE(eventually([&] { return !has("one") && !has("two"); }));
  EXPECT_TRUE(has("three"));
  EXPECT_TRUE(has("four")) << "no job names it beside the damaged one";
}

TEST_F(OperationCallTest, AnInspectionIsForgottenWithItsCaller) {
  on_farm([](FarmLoop::TaskContext& context) {
    context.farm.worker_connected(SessionId{1}, {"w", "h", 1, 1, "class-a", kRendererVersion, {}, false, "m", true},
                                  context.now, context.effects);
  });
  const Sha256 digest = sha256("{}");
  const auto upload = runtime->assets().start_upload(digest).value();
  ASSERT_TRUE(upload->append(as_byte_view("{}")).ok());
  ASSERT_TRUE(upload->finish().ok());
  const auto asked = call("InspectScene");
  auto& request = static_cast<v1::InspectSceneRequest&>(asked->request());
  v1::InspectSceneRequest::File* const file = request.add_files();
  file->set_path("a.json");
  file->set_digest(digest_bytes(digest));
  request.add_scene("a.json");
  std::future<Status> answer = start(asked, anonymous_identity());
  on_farm([](FarmLoop::TaskContext& context) { EXPECT_EQ(context.inspections.size(), 1u); });
  asked->cancel();
  EXPECT_EQ(answer.get().code(), StatusCode::kCancelled);
  on_farm([](FarmLoop::TaskContext& context) { EXPECT_TRUE(context.inspections.empty()); });
}

}  // namespace
}  // namespace lightmill::test
