// Dishonest and faulty machines, with real processes. Audits find their results, and the farm renders them again.
#include <gtest/gtest.h>

#include "common/wire/farm_messages.h"
#include "lightmill/v1/access_service.grpc.pb.h"
#include "lightmill/v1/worker_service.grpc.pb.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"
#include "worker/render/worker_class.h"

namespace lightmill::test {
namespace {

std::unique_ptr<BackgroundProcess> start_liar(const Farm& farm, const std::string& name, const std::string& machine,
                                              const std::string& share, const std::string& of_class = "") {
  std::vector<std::string> arguments{program("lying_worker"), farm.address(), name, machine, share};
  if (!of_class.empty()) {
    arguments.push_back(of_class);
  }
  return std::make_unique<BackgroundProcess>(arguments, (farm.folder() / (name + ".log")).string());
}

const v1::Worker* named(const std::vector<v1::Worker>& workers, const std::string& name) {
  const auto found = std::ranges::find_if(workers, [&](const v1::Worker& each) { return each.name() == name; });
  return found == workers.end() ? nullptr : &*found;
}

/// Waits until this many are connected.
void wait_for_workers(Farm& farm, std::ptrdiff_t count) {
  FarmClient client = farm.client();
  ASSERT_TRUE(eventually([&] { return std::ranges::count(client.workers(), false, &v1::Worker::away) >= count; }))
      << farm.server_log();
}

v1::Job submit_audited(Farm& farm, const Picture& picture, double share, bool allow_mixed = false) {
  FarmClient client = farm.client();
  client.upload_assets(shipped_scene(picture.scene));
  JobSpec spec = job_of(picture, allow_mixed ? "mixed" : "audited");
  spec.audit_share = share;
  spec.allow_mixed = allow_mixed;
  v1::SubmitJobRequest request;
  to_wire(spec, &request);
  v1::Job job;
  grpc::ClientContext context;
  const grpc::Status status = client.stub().SubmitJob(&context, request, &job);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return job;
}

class Audits : public testing::TestWithParam<const char*> {};

TEST_P(Audits, ADishonestWorkerAmongThreeMachinesChangesNothing) {
  Farm farm;
  const auto liar = start_liar(farm, "liar", "machine-1", GetParam());
  const auto honest = start_liar(farm, "honest", "machine-2", "0");
  farm.add_worker(1, "w3");
  wait_for_workers(farm, 3);
  Picture picture;
  picture.side = 256;  // 16 tiles of several ranges each, so a liar with one in five nodes lies in some
  picture.samples = 24;
  const v1::Job job = submit_audited(farm, picture, 1);
  expect_reference_film(farm.client(), job.id(), picture);
  const v1::Job ended = farm.client().job(job.id());
  EXPECT_EQ(ended.results_unaudited(), 0u) << ended.ShortDebugString();
  EXPECT_GT(ended.counters().results_audited(), 0u);
  const std::vector<v1::Worker> workers = farm.client().workers();
  ASSERT_NE(named(workers, "liar"), nullptr);
  EXPECT_NE(named(workers, "liar")->quarantine(), "") << farm.server_log();
  for (const char* name : {"honest", "w3"}) {
    ASSERT_NE(named(workers, name), nullptr);
    EXPECT_EQ(named(workers, name)->quarantine(), "");
  }
  EXPECT_TRUE(eventually([&] { return farm.log("liar").find("in quarantine") != std::string::npos; }));
  v1::ListActionsResponse log;
  grpc::ClientContext listing;
  ASSERT_TRUE(v1::AccessService::NewStub(grpc::CreateChannel(farm.address(), grpc::InsecureChannelCredentials()))
                  ->ListActions(&listing, {}, &log)
                  .ok());
  const auto put = std::ranges::find(log.actions(), "QuarantineWorker", &v1::Action::operation);
  ASSERT_NE(put, log.actions().end()) << log.ShortDebugString();
  EXPECT_EQ(put->caller() + put->about(), "liar");
  EXPECT_EQ(put->change(), "put into quarantine: " + named(workers, "liar")->quarantine());

  // A restarted coordinator remembers it.
  kill_at_once(farm.server());
  farm.start_server();
  wait_for_workers(farm, 3);
  EXPECT_NE(named(farm.client().workers(), "liar")->quarantine(), "");
  v1::ReleaseWorkerRequest request;
  request.set_name("liar");
  v1::ReleaseWorkerResponse response;
  grpc::ClientContext context;
  FarmClient client = farm.client();
  EXPECT_TRUE(client.stub().ReleaseWorker(&context, request, &response).ok());
  EXPECT_EQ(named(farm.client().workers(), "liar")->quarantine(), "");
}
INSTANTIATE_TEST_SUITE_P(Lies, Audits, testing::Values("1", "0.2"),
                         [](const auto& info) { return info.index == 0 ? "Always" : "InOneOfFive"; });

/// All pixels of the first half differ by at most this many last bits.
void expect_near(const FilmPlanes& film, const FilmPlanes& other) {
  ASSERT_EQ(film.mean_a.size(), other.mean_a.size());
  for (std::size_t i = 0; i < film.mean_a.size(); ++i) {
    ASSERT_NEAR(film.mean_a[i], other.mean_a[i], 1e-6f * (1 + other.mean_a[i])) << i;
  }
}

// Workers of two classes render one picture. Each node of one class has another last bit. No worker is accused, and
// each class audits its own results.
TEST(MixedFarm, DiffersFromTheReferenceOnlyInTheLastBits) {
  Farm farm;
  farm.add_worker(1, "usual");
  const auto one = start_liar(farm, "other-1", "machine-1", "1", "other class"),
             two = start_liar(farm, "other-2", "machine-2", "1", "other class");
  wait_for_workers(farm, 3);
  Picture picture;
  picture.side = 256;
  picture.samples = 24;
  const v1::Job job = submit_audited(farm, picture, 1, true);
  const v1::Job ended = farm.client().wait_until_ended(job.id());
  ASSERT_EQ(ended.state(), v1::JOB_STATE_DONE) << ended.ShortDebugString();
  EXPECT_EQ(ended.min_tile_samples(), picture.samples);
  EXPECT_EQ(ended.max_tile_samples(), picture.samples);
  EXPECT_EQ(ended.fingerprint_class(), kMixedClass);
  EXPECT_TRUE(ended.allow_mixed());
  EXPECT_GT(ended.counters().results_audited(), 0u) << "the other class has two machines";
  EXPECT_GT(ended.results_unaudited(), 0u) << "the usual one has one";
  EXPECT_EQ(ended.counters().nodes_dropped(), 0u);
  const std::vector<v1::Worker> workers = farm.client().workers();
  for (const char* name : {"usual", "other-1", "other-2"}) {
    ASSERT_NE(named(workers, name), nullptr);
    EXPECT_EQ(named(workers, name)->quarantine(), "");
    EXPECT_GT(named(workers, name)->results(), 0u);
  }
  // The usual class alone gives the reference. The values of the other class are adjacent floats.
  one->send(SIGTERM);
  two->send(SIGTERM);
  EXPECT_TRUE(one->wait() && two->wait());
  const v1::Job alone = submit_audited(farm, picture, 0);
  expect_reference_film(farm.client(), alone.id(), picture);
  const FilmPlanes mixed = farm.client().film(job.id()), usual = farm.client().film(alone.id());
  EXPECT_NE(film_hash(mixed).hex(), film_hash(usual).hex());
  expect_near(mixed, usual);
}

/// A worker that sends any results the test wants.
class RawWorker {
 public:
  RawWorker(const Farm& farm, const std::string& name)
      : stub_(v1::WorkerService::NewStub(grpc::CreateChannel(farm.address(), grpc::InsecureChannelCredentials()))),
        stream_(stub_->Work(&context_)) {
    context_.set_deadline(std::chrono::system_clock::now() + kTimeout);
    WorkerHello hello;
    hello.name = hello.host = hello.machine = name;
    hello.fingerprint_class = worker_class(program("lightmill-image-decoder"));
    hello.renderer_version = std::string(kRendererVersion);
    say(hello);
  }
  ~RawWorker() {
    context_.TryCancel();
    (void)stream_->Finish();
  }
  void say(const WorkerMessage& message) {
    v1::WorkRequest request;
    to_wire(message, &request);
    (void)stream_->Write(request);
  }
  /// The next message of this kind, or nothing if the stream ends first.
  template <class T>
  std::optional<T> next() {
    for (v1::WorkResponse response; stream_->Read(&response);) {
      const Result<CoordinatorMessage> message = from_wire(response);
      if (message.ok() && std::holds_alternative<T>(*message)) {
        return std::get<T>(*message);
      }
    }
    return std::nullopt;
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::WorkerService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WorkRequest, v1::WorkResponse>> stream_;
};

// One worker sends all samples of every tile on its first lease, as one result per tile.
TEST(ForgedResults, DoNotReplaceAPicture) {
  Farm farm;
  Picture picture;
  picture.side = 256;
  picture.samples = 16;
  const v1::Job job = submit_audited(farm, picture, 0.01);
  RawWorker liar(farm, "liar");
  const std::optional<JobDescription> description = liar.next<JobDescription>();
  ASSERT_TRUE(description);
  const std::optional<LeaseGrant> grant = liar.next<LeaseGrant>();
  ASSERT_TRUE(grant);
  for (std::uint32_t tile = 0; tile < 16; ++tile) {
    WorkerResult forged;
    forged.lease = grant->lease;
    forged.key = {grant->unit.job, TileId{tile}, {4, 0}};
    forged.node = {forged.key.range, std::vector<float>(std::size_t{64} * 64 * 2 * 3, 1e3f), 0};
    forged.hash = hash_of(forged.node);
    forged.render_digest = description->render_digest;
    forged.seconds = 1e-6;
    forged.tag = grant->tags[0];
    liar.say(forged);
  }
  const std::optional<Dismissal> dismissal = liar.next<Dismissal>();
  ASSERT_TRUE(dismissal) << farm.server_log();
  EXPECT_NE(dismissal->reason.find("never granted"), std::string::npos) << dismissal->reason;
  EXPECT_EQ(farm.client().job(job.id()).counters().results_merged(), 0u);
  farm.add_worker(1, "honest");
  expect_reference_film(farm.client(), job.id(), picture);
}

TEST(UnauditedFarm, ReportsItsResultsAsUnaudited) {
  Farm farm;
  farm.add_worker(1, "w1");
  farm.add_worker(1, "w2");  // on the same machine
  wait_for_workers(farm, 2);
  Picture picture;
  picture.samples = 4;
  const v1::Job job = submit_audited(farm, picture, 1);
  const v1::Job ended = farm.client().wait_until_ended(job.id());
  EXPECT_EQ(ended.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(ended.counters().results_audited(), 0u);
  EXPECT_EQ(ended.results_unaudited(), ended.counters().results_merged());
  EXPECT_TRUE(ended.one_identity());
}

}  // namespace
}  // namespace lightmill::test
