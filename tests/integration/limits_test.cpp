// Limits of one caller over real connections. A call above the limit is refused with the limit's name, and other
// callers are not affected.
#include <gtest/gtest.h>

#include <csignal>

#include "common/wire/farm_messages.h"
#include "tests/support/farm.h"

namespace lightmill::test {
namespace {

using grpc::StatusCode;

grpc::Status list(v1::RenderService::Stub& stub) {
  grpc::ClientContext context;
  v1::ListJobsResponse response;
  return stub.ListJobs(&context, {}, &response);
}

bool says(const grpc::Status& status, const std::string& part) {
  return status.error_message().find(part) != std::string::npos;
}

TEST(Limits, RequestsPerSecondAreLimited) {
  Farm farm({"--caller-requests", "2"});
  FarmClient client = farm.client();
  int taken = 0;
  grpc::Status refused;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually([&] {
    refused = list(client.stub());
    taken += refused.ok() ? 1 : 0;
    return !refused.ok();
  }));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GE(taken, 15);
  EXPECT_LE(taken, 21 + 2 * seconds) << "on a machine of any speed";
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused, "2 requests per second from one caller (--caller-requests): try again in "))
      << refused.error_message();
  EXPECT_TRUE(eventually([&] { return list(client.stub()).ok(); })) << "after its own messages";
}

TEST(Limits, StreamsOfOneCallerAreLimited) {
  Farm farm({"--caller-streams", "2"});
  FarmClient client = farm.client();
  client.upload_assets();
  v1::WatchJobRequest request;
  request.set_id(client.submit({}).id());
  struct Watch {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::WatchJobResponse>> reader;
    v1::WatchJobResponse update;
  };
  const auto watch = [&](Watch& each) {
    each.reader = client.stub().WatchJob(&each.context, request);
    return each.reader->Read(&each.update);
  };
  Watch first, second, third, fourth;
  EXPECT_TRUE(watch(first));
  EXPECT_TRUE(watch(second));
  EXPECT_FALSE(watch(third));
  const grpc::Status refused = third.reader->Finish();
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused, "2 watched jobs of one caller (--caller-streams)")) << refused.error_message();
  first.context.TryCancel();
  (void)first.reader->Finish();
  EXPECT_TRUE(eventually([&] {
    Watch again;
    const bool taken = watch(again);
    again.context.TryCancel();
    (void)again.reader->Finish();
    return taken;
  })) << "its slot is free after its end";
  second.context.TryCancel();
  (void)second.reader->Finish();
}

TEST(Limits, AWorkerJoinsAFullFarmWhenAnotherLeaves) {
  Farm farm({"--max-workers", "1"});
  farm.add_worker(1, "first");
  ASSERT_TRUE(eventually([&] { return farm.met("first"); }));
  BackgroundProcess& second = farm.add_worker(1, "second");
  const std::string reason = "the farm is full: it takes 1 workers (--max-workers)";
  EXPECT_TRUE(eventually([&] { return farm.worker_log("second").find(reason) != std::string::npos; }));
  farm.worker("first").send(SIGTERM);
  EXPECT_TRUE(eventually([&] { return farm.met("second"); }));
  EXPECT_FALSE(second.wait(std::chrono::milliseconds(0))) << "it stayed, and retried";
}

TEST(Limits, JobsOfOneUserAreLimited) {
  Farm farm({"--user-jobs", "2"});
  FarmClient client = farm.client();
  client.upload_assets();
  const auto submit = [&](const std::string& request_id, const std::string& owner) {
    JobSpec spec = job_of({}, request_id);
    spec.owner = owner;
    v1::SubmitJobRequest request;
    to_wire(spec, &request);
    grpc::ClientContext context;
    v1::Job job;
    return client.stub().SubmitJob(&context, request, &job);
  };
  EXPECT_TRUE(submit("1", "ada").ok());
  EXPECT_TRUE(submit("2", "ada").ok());
  const grpc::Status refused = submit("3", "ada");
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused, "at most 2 jobs of one user, 'ada'")) << refused.error_message();
  EXPECT_TRUE(submit("2", "ada").ok()) << "a repetition creates no job";
  EXPECT_TRUE(submit("4", "bob").ok());
}

}  // namespace
}  // namespace lightmill::test
