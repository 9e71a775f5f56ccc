// Queries of a cluster: how many workers the farm could use, as KEDA asks it, and the coordinator's health.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "externalscaler/externalscaler.grpc.pb.h"
#include "tests/integration/health.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

/// A client like KEDA, with KEDA's metadata.
class Scaler {
 public:
  explicit Scaler(const std::string& address)
      : stub_(
            externalscaler::ExternalScaler::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {
    ref_.set_name("lightmill-worker");
    ref_.set_namespace_("farm");
    (*ref_.mutable_scalermetadata())["scalerAddress"] = address;
  }

  bool is_active() {
    grpc::ClientContext context;
    externalscaler::IsActiveResponse response;
    const grpc::Status status = stub_->IsActive(&context, ref_, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.result();
  }
  externalscaler::MetricSpec spec() {
    grpc::ClientContext context;
    externalscaler::GetMetricSpecResponse response;
    const grpc::Status status = stub_->GetMetricSpec(&context, ref_, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.metricspecs_size(), 1);
    return response.metricspecs_size() == 1 ? response.metricspecs(0) : externalscaler::MetricSpec();
  }
  grpc::Status get(const std::string& metric, externalscaler::GetMetricsResponse& response) {
    grpc::ClientContext context;
    externalscaler::GetMetricsRequest request;
    *request.mutable_scaledobjectref() = ref_;
    request.set_metricname(metric);
    return stub_->GetMetrics(&context, request, &response);
  }
  /// KEDA's number of replicas: the value over one replica's share.
  double replicas() {
    const externalscaler::MetricSpec one = spec();
    externalscaler::GetMetricsResponse response;
    const grpc::Status status = get(one.metricname(), response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    if (response.metricvalues_size() != 1 || one.targetsize() <= 0) {
      ADD_FAILURE() << response.ShortDebugString() << one.ShortDebugString();
      return -1;
    }
    const externalscaler::MetricValue& value = response.metricvalues(0);
    EXPECT_EQ(value.metricname(), one.metricname());
    EXPECT_EQ(static_cast<double>(value.metricvalue()), value.metricvaluefloat()) << "old KEDAs read the integer";
    EXPECT_EQ(static_cast<double>(one.targetsize()), one.targetsizefloat());
    return value.metricvaluefloat() / one.targetsizefloat();
  }
  std::unique_ptr<grpc::ClientReader<externalscaler::IsActiveResponse>> listen(grpc::ClientContext& context) {
    context.set_deadline(std::chrono::system_clock::now() + kTimeout);
    return stub_->StreamIsActive(&context, ref_);
  }

 private:
  std::unique_ptr<externalscaler::ExternalScaler::Stub> stub_;
  externalscaler::ScaledObjectRef ref_;
};

TEST(Scaler, KedaLearnsHowManyWorkersAJobCanUse) {
  Farm farm;
  Scaler scaler(farm.address());
  EXPECT_FALSE(scaler.is_active());
  EXPECT_EQ(scaler.replicas(), 0);
  FarmClient client = farm.client();
  Picture endless;
  endless.samples = 1'000'000;  // far more than a minute on this machine
  const std::uint64_t job = client.submit(endless).id();
  EXPECT_TRUE(scaler.is_active());
  EXPECT_EQ(scaler.replicas(), 1) << "the first one, which finds the cost";
  farm.add_worker(1, "w");
  EXPECT_TRUE(eventually([&] { return scaler.replicas() > 1; })) << "the one that found the cost";
  grpc::ClientContext context;
  v1::CancelJobRequest cancel;
  cancel.set_id(job);
  v1::Job cancelled;
  EXPECT_TRUE(client.stub().CancelJob(&context, cancel, &cancelled).ok());
  EXPECT_TRUE(eventually([&] { return scaler.replicas() == 0; }));
  EXPECT_FALSE(scaler.is_active());
}

TEST(Scaler, AnUnknownMetricIsRefused) {
  Farm farm;
  Scaler scaler(farm.address());
  externalscaler::GetMetricsResponse response;
  const grpc::Status status = scaler.get("queue-length", response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_NE(status.error_message().find("queue-length"), std::string::npos) << status.error_message();
  EXPECT_NE(status.error_message().find(scaler.spec().metricname()), std::string::npos) << status.error_message();
}

TEST(Scaler, AListenerLearnsOfTheFirstJobAndOfTheEndOfTheLast) {
  Farm farm;
  Scaler scaler(farm.address());
  grpc::ClientContext context;
  const auto stream = scaler.listen(context);
  externalscaler::IsActiveResponse heard;
  ASSERT_TRUE(stream->Read(&heard));
  EXPECT_FALSE(heard.result());
  Picture small;
  small.side = 64;
  small.samples = 4;
  const std::uint64_t job = farm.client().submit(small).id();
  ASSERT_TRUE(stream->Read(&heard));
  EXPECT_TRUE(heard.result());
  farm.add_worker(1, "w");
  ASSERT_TRUE(stream->Read(&heard));
  EXPECT_FALSE(heard.result());
  EXPECT_EQ(farm.client().job(job).state(), v1::JOB_STATE_DONE);
  farm.server().send(SIGTERM);
  EXPECT_FALSE(stream->Read(&heard));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE) << "listen again, wherever it is next";
}

TEST(Health, TheHealthPortAnswersNothingElse) {
  const TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  Farm farm({"--health", "127.0.0.1:0", "--health-port-file", port_file});
  const std::string address = health_address(port_file);
  EXPECT_EQ(health(address), "SERVING");
  EXPECT_EQ(health(address, "live"), "SERVING");
  EXPECT_EQ(health(address, "other"), fmt::format("error {}", static_cast<int>(grpc::StatusCode::NOT_FOUND)));
  EXPECT_EQ(health(farm.address()), "SERVING");
  const auto stub = v1::RenderService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::ListJobsResponse jobs;
  EXPECT_EQ(stub->ListJobs(&context, {}, &jobs).error_code(), grpc::StatusCode::UNIMPLEMENTED);
  farm.server().send(SIGTERM);
  EXPECT_TRUE(eventually([&] { return health(address) != "SERVING"; }));
}

TEST(Health, AWatcherLearnsOfTheShutdown) {
  const TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  Farm farm({"--health", "127.0.0.1:0", "--health-port-file", port_file});
  grpc::GenericStub stub(grpc::CreateChannel(health_address(port_file), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(&context, "/grpc.health.v1.Health/Watch", &queue);
  const auto done = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto hear = [&] {
    grpc::ByteBuffer reply;
    stream->Read(&reply, nullptr);
    grpc::Slice whole;
    return done() && reply.DumpToSingleSlice(&whole).ok()
               ? std::string(reinterpret_cast<const char*>(whole.begin()), whole.size())
               : "nothing";
  };
  stream->StartCall(nullptr);
  ASSERT_TRUE(done());
  const grpc::Slice all;  // HealthCheckRequest{}
  stream->WriteLast(grpc::ByteBuffer(&all, 1), grpc::WriteOptions(), nullptr);
  ASSERT_TRUE(done());
  EXPECT_EQ(hear(), "\x08\x01") << "SERVING";
  farm.server().send(SIGTERM);
  std::string last;
  while ((last = hear()) == "\x08\x01") {  // a service may repeat a state
  }
  EXPECT_EQ(last, "\x08\x02") << "NOT_SERVING";
}

TEST(Health, ATakenPortIsReported) {
  const TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  const Farm farm({"--health", "127.0.0.1:0", "--health-port-file", port_file});
  const CommandResult second = run_command({program("lightmill-server"), "--data", (folder.path() / "data").string(),
                                            "--listen", "127.0.0.1:0", "--health", health_address(port_file)});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.err.find("--health"), std::string::npos) << second.err;
}

}  // namespace
}  // namespace lightmill::test
