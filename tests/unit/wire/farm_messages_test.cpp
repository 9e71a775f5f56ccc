#include "common/wire/farm_messages.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/wire/bytes.h"
#include "common/wire/limits.h"
#include "common/wire/scene_proto.h"
#include "lightmill/v1/farm.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/worker_service.pb.h"
#include "tests/support/error_message.h"
#include "tests/unit/wire/example_messages.h"

namespace lightmill::test {
namespace {

void expect_equal(const RenderSettings& a, const RenderSettings& b) {
  EXPECT_EQ(render_digest(a, "class"), render_digest(b, "class"));
  EXPECT_EQ(a.crop, b.crop);
  EXPECT_EQ(a.layers, b.layers);
  EXPECT_EQ(a.meters, b.meters);
}

WorkerMessage through_wire(const WorkerMessage& message) {
  v1::WorkRequest wire;
  to_wire(message, &wire);
  v1::WorkRequest received;
  EXPECT_TRUE(received.ParseFromString(wire.SerializeAsString()));
  Result<WorkerMessage> back = from_wire(received);
  EXPECT_TRUE(back.ok()) << back.status();
  return *back;
}

CoordinatorMessage through_wire(const CoordinatorMessage& message) {
  v1::WorkResponse wire;
  to_wire(message, &wire);
  v1::WorkResponse received;
  EXPECT_TRUE(received.ParseFromString(wire.SerializeAsString()));
  Result<CoordinatorMessage> back = from_wire(received);
  EXPECT_TRUE(back.ok()) << back.status();
  return *back;
}

void expect_every_field(const google::protobuf::Message& message) {
  const google::protobuf::Reflection& fields = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = message.GetDescriptor()->field(i);
    EXPECT_TRUE(field->is_repeated() ? fields.FieldSize(message, field) > 0 : fields.HasField(message, field))
        << field->full_name();
  }
}

TEST(FarmMessages, AJobSpecificationSurvivesARoundTrip) {
  const JobSpec spec = example_spec();
  v1::SubmitJobRequest wire;
  to_wire(spec, &wire);
  v1::SubmitJobRequest received;
  ASSERT_TRUE(received.ParseFromString(wire.SerializeAsString()));
  const Result<JobSpec> back = from_wire(received);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->request_id, spec.request_id);
  EXPECT_EQ(back->name, spec.name);
  EXPECT_EQ(back->owner, spec.owner);
  EXPECT_EQ(back->host, spec.host);
  EXPECT_EQ(back->parent, spec.parent);
  EXPECT_EQ(back->priority, spec.priority);
  EXPECT_EQ(back->audit_share, spec.audit_share);
  EXPECT_EQ(back->allow_mixed, spec.allow_mixed);
  EXPECT_EQ(back->goal, spec.goal);
  expect_equal(back->settings, spec.settings);
  expect_every_field(received.job());
  expect_every_field(received.job().goal());
  expect_every_field(received.job().settings());
  v1::SubmitJobRequest again;
  to_wire(*back, &again);
  EXPECT_EQ(again.SerializeAsString(), wire.SerializeAsString());
}

TEST(FarmMessages, AJobHasEveryFieldOfItsStatus) {
  JobStatus status;
  status.id = JobId{5};
  status.spec = example_spec();
  status.method_notes = {true, {"one", "two"}, {"path: some light is missing"}, {"path", "whitted"}};
  status.fingerprint_class = "zen";
  status.reason = "samples";
  status.reached = GoalLimit::error;
  status.samples_done = 10;
  status.samples_wanted = 20;
  status.min_tile_samples = 1;
  status.max_tile_samples = 3;
  status.frame_samples = 2;
  status.active_seconds = 1.5;
  status.worker_seconds = 2.5;
  status.samples_per_second = 1e6;
  status.eta_seconds = -1;
  status.error = {0.01, 0.001, true};
  status.history = {{16, 1.5, 0.5, 0.25}, {24.5, 3, 0.25, 0.125}};
  status.counters = {1, 2, 3, 4, 5, 6, 7};
  status.one_identity = true;
  status.results_unaudited = 8;
  status.audits_lost = 9;
  status.submitted_unix_ms = 1'700'000'000'000;
  status.finished_unix_ms = 1'700'000'000'001;
  status.render_digest = sha256("digest");
  for (const JobState state :
       {JobState::queued, JobState::running, JobState::paused, JobState::done, JobState::failed, JobState::cancelled}) {
    status.state = state;
    v1::Job job;
    to_wire(status, &job);
    expect_every_field(job);
    EXPECT_EQ(from_wire(job.state()).value(), state);
    EXPECT_EQ(from_wire(job.method_notes()).value(), status.method_notes);
    EXPECT_EQ(from_wire(job.goal()).value(), status.spec.goal);
    EXPECT_EQ(from_wire(job.reached()).value(), GoalLimit::error);
    EXPECT_EQ(from_wire(job.crop()).value(), status.spec.settings.crop);
    EXPECT_EQ(job.error().half_width(), 0.001);
    ASSERT_EQ(job.history_size(), 2);
    EXPECT_EQ(from_wire(job.history(1)), status.history[1]);
    const JobCounters counters = from_wire(job.counters());
    EXPECT_EQ(counters.non_finite, 5u);
    EXPECT_EQ(counters.nodes_dropped, 7u);
    EXPECT_EQ(digest_from_bytes(job.render_digest()).value(), status.render_digest);
    EXPECT_EQ(hash_from_bytes(job.trace_id()).value(), trace_id("request-1"));
    for (const char* text :
         {"id: 5 name: \"box\" owner: \"ada\" host: \"engine\" method: \"path\" fingerprint_class: \"zen\" parent: 17",
          "reason: \"samples\" priority: -3", "width: 640 height: 480",
          "seed: 18446744073709551615 samples_done: 10 samples_wanted: 20",
          "min_tile_samples: 1 max_tile_samples: 3 active_seconds: 1.5 worker_seconds: 2.5",
          "samples_per_second: 1000000 eta_seconds: -1", "submitted_unix_ms: 1700000000000",
          "finished_unix_ms: 1700000000001", "frame_samples: 2 audit_share: 0.25 results_unaudited: 8",
          "layers: \"direct\" layers: \"normal\" layers: \"depth\" layers: \"id\" allow_mixed: true",
          "one_identity: true audits_lost: 9"}) {
      EXPECT_NE(job.ShortDebugString().find(text), std::string::npos) << job.ShortDebugString();
    }
  }
}

TEST(FarmMessages, AnUnknownErrorAndDigestAreAbsent) {
  v1::Job job;
  to_wire(JobStatus(), &job);
  EXPECT_FALSE(job.has_error());
  EXPECT_TRUE(job.render_digest().empty());
}

TEST(FarmMessages, ANodeKeepsItsBits) {
  const WorkerResult sent = example_result();
  const WorkerResult got = std::get<WorkerResult>(through_wire(WorkerMessage(sent)));
  EXPECT_EQ(got.lease, sent.lease);
  EXPECT_EQ(got.key, sent.key);
  EXPECT_EQ(got.node.range, sent.node.range);
  EXPECT_EQ(got.node.non_finite, sent.node.non_finite);
  EXPECT_EQ(hash_of(got.node), sent.hash);
  EXPECT_EQ(got.hash, sent.hash);
  EXPECT_EQ(got.render_digest, sent.render_digest);
  EXPECT_EQ(got.seconds, sent.seconds);
  EXPECT_EQ(got.trace, sent.trace);
  EXPECT_EQ(got.tag, sent.tag);
}

TEST(FarmMessages, AResultWithoutATraceIdIsAccepted) {
  v1::WorkRequest result;
  to_wire(WorkerMessage(example_result()), &result);
  result.mutable_result()->clear_trace_id();
  const Result<WorkerMessage> got = from_wire(result);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(std::get<WorkerResult>(*got).trace, Hash128{});
  result.mutable_result()->set_trace_id("short");
  EXPECT_NE(error_message(from_wire(result)).find("trace_id"), std::string::npos);
}

TEST(FarmMessages, WorkerMessagesSurviveARoundTrip) {
  WorkerHello hello{"w1", "host", 123, 8, "class", "version", {}, true};
  hello.held.push_back(
      {LeaseId{1}, 7, sha256("job"), {JobId{3}, {2, 9}, {TileId{0}, TileId{5}}}, {sha256("tag 0"), sha256("tag 5")}});
  const auto back = std::get<WorkerHello>(through_wire(WorkerMessage(hello)));
  EXPECT_EQ(back.name, "w1");
  EXPECT_EQ(back.host, "host");
  EXPECT_EQ(back.pid, 123u);
  EXPECT_EQ(back.threads, 8u);
  EXPECT_EQ(back.fingerprint_class, "class");
  EXPECT_EQ(back.renderer_version, "version");
  EXPECT_TRUE(back.draining);
  ASSERT_EQ(back.held.size(), 1u);
  EXPECT_EQ(back.held[0].lease, LeaseId{1});
  EXPECT_EQ(back.held[0].epoch, 7u);
  EXPECT_EQ(back.held[0].render_digest, sha256("job"));
  EXPECT_EQ(back.held[0].unit, hello.held[0].unit);
  EXPECT_EQ(back.held[0].tags, hello.held[0].tags);

  const std::vector<LeaseId> leases{LeaseId{1}, LeaseId{std::numeric_limits<std::uint64_t>::max()}};
  const auto heartbeat_back = [](const WorkerHeartbeat& heartbeat) {
    return std::get<WorkerHeartbeat>(through_wire(WorkerMessage(heartbeat)));
  };
  EXPECT_EQ(heartbeat_back({leases}).leases, leases);
  EXPECT_EQ(heartbeat_back({leases}).longest_wait, std::nullopt);
  EXPECT_EQ(heartbeat_back({{}, std::chrono::milliseconds(2500)}).longest_wait, std::chrono::milliseconds(2500));
  EXPECT_EQ(heartbeat_back({{}, Duration::zero()}).longest_wait, Duration::zero());
  EXPECT_EQ(heartbeat_back({{}, std::chrono::hours(100)}).longest_wait, std::chrono::hours(24));
  const std::vector<TileAtWork> at_work{{LeaseId{7}, TileId{8}, 9.5}};
  EXPECT_EQ(heartbeat_back({{}, std::nullopt, at_work}).at_work, at_work);
  EXPECT_EQ(std::get<WorkerReturn>(through_wire(WorkerMessage(WorkerReturn{LeaseId{6}}))).lease, LeaseId{6});
  const auto refusal = std::get<WorkerRefusal>(through_wire(WorkerMessage(WorkerRefusal{JobId{8}, "damaged"})));
  EXPECT_EQ(refusal.job, JobId{8});
  EXPECT_EQ(refusal.reason, "damaged");
  EXPECT_FALSE(refusal.own_limits);
  EXPECT_TRUE(
      std::get<WorkerRefusal>(through_wire(WorkerMessage(WorkerRefusal{JobId{8}, "too large", true}))).own_limits);
  const Inspection found{"scene",  {sha256("a")}, {"note"}, {{"what", "it is"}}, {{"path", true, "why"}},
                         {"path"}, {"c"}};
  const auto inspected = std::get<InspectReport>(
      through_wire(WorkerMessage(InspectReport{InspectionId{4}, std::make_shared<const Inspection>(found)})));
  ASSERT_TRUE(inspected.found.ok());
  const Inspection& read = **inspected.found;
  EXPECT_EQ(std::tie(read.scene, read.assets, read.notices, read.chosen, read.cameras),
            std::tie(found.scene, found.assets, found.notices, found.chosen, found.cameras));
  EXPECT_EQ(read.facts.at(0).value, "it is");
  EXPECT_TRUE(read.methods.at(0).admitted);
  EXPECT_EQ(read.methods.at(0).reason, "why");
  const auto refused = std::get<InspectReport>(
      through_wire(WorkerMessage(InspectReport{InspectionId{4}, invalid_argument("a.obj:2: no")})));
  EXPECT_EQ(refused.found.status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(message_of(refused.found.status()), "a.obj:2: no");
  const auto report = std::get<PilotReport>(through_wire(WorkerMessage(PilotReport{LeaseId{9}, 1, {"cheaper"}, 0.25})));
  EXPECT_EQ(report.lease, LeaseId{9});
  EXPECT_EQ(report.choice, 1u);
  EXPECT_EQ(report.reasons, std::vector<std::string>{"cheaper"});
  EXPECT_EQ(report.seconds, 0.25);
  EXPECT_TRUE(report.allocation.even());
  const Allocation uneven = Allocation::of({-2, 0, 2}).value();
  EXPECT_EQ(std::get<PilotReport>(through_wire(WorkerMessage(PilotReport{LeaseId{9}, 0, {}, 0, uneven}))).allocation,
            uneven);
  EXPECT_TRUE(std::holds_alternative<WorkerDraining>(through_wire(WorkerMessage(WorkerDraining{}))));
}

TEST(FarmMessages, QuotedBytesArriveAsText) {
  const std::string rubbish = "f 1 2 \xe9\n" + std::string(100'000, 'x');
  const auto arrived = [](const WorkerMessage& sent) {
    v1::WorkRequest wire, read;
    to_wire(sent, &wire);
    EXPECT_TRUE(read.ParseFromString(wire.SerializeAsString())) << "it is not UTF-8";
    const Result<WorkerMessage> message = from_wire(read);
    EXPECT_TRUE(message.ok()) << message.status();
    return message.value();
  };
  const std::string beginning = "f 1 2 \\xe9\n";
  EXPECT_TRUE(std::get<WorkerRefusal>(arrived(WorkerRefusal{JobId{1}, rubbish})).reason.starts_with(beginning));
  EXPECT_TRUE(std::get<PilotReport>(arrived(PilotReport{LeaseId{1}, 0, {rubbish}})).reasons[0].starts_with(beginning));
  const Status failed = make_error(StatusCode::kInvalidArgument, "{}", rubbish);
  EXPECT_TRUE(message_of(std::get<InspectReport>(arrived(InspectReport{InspectionId{1}, failed})).found.status())
                  .starts_with(beginning));
}

TEST(FarmMessages, AWorkerCannotAnswerAboutTheUsersRights) {
  for (const StatusCode code : {StatusCode::kInvalidArgument, StatusCode::kUnauthenticated, StatusCode::kOk}) {
    v1::InspectReport report;
    report.set_code(static_cast<int>(code == StatusCode::kOk ? static_cast<StatusCode>(99) : code));
    report.set_problem("line\x1b[2J");
    const Result<InspectReport> read = from_wire(report);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->found.status().code(), code == StatusCode::kInvalidArgument ? code : StatusCode::kUnknown);
    EXPECT_EQ(message_of(read->found.status()), "line\\x1b[2J");
  }
}

TEST(FarmMessages, ASmallMessageCannotHaveAHugeScene) {
  std::string packed;
  for (std::size_t i = 0; i <= kMaxInspectedEntries; ++i) {
    packed.append("\x2a\0", 2);  // an empty object
  }
  EXPECT_EQ(count_entries(packed), kMaxInspectedEntries + 1);
  v1::InspectReport report;
  report.mutable_found()->set_packed(packed);
  EXPECT_EQ(message_of(from_wire(report).status()), "found: a scene of 100001 entries is beyond the limit of 100000");
  report.mutable_found()->set_packed(packed.substr(2));
  EXPECT_TRUE(from_wire(report).ok()) << from_wire(report).status();
  std::string more;
  for (std::size_t i = 0; i <= 2 * kMaxSceneEntries; ++i) {
    more.append("\x2a\0", 2);
  }
  EXPECT_EQ(message_of(unpack_scene(more).status()),
            "a packed scene of 2000001 entries is more than the limit of 2000000");
}

TEST(FarmMessages, CoordinatorMessagesSurviveARoundTrip) {
  const Welcome welcome{42, std::chrono::milliseconds(2500), std::chrono::seconds(10), {7, 8}, "ada/w1"};
  const auto greeted = std::get<Welcome>(through_wire(CoordinatorMessage(welcome)));
  EXPECT_EQ(greeted.epoch, 42u);
  EXPECT_EQ(greeted.heartbeat_interval, welcome.heartbeat_interval);
  EXPECT_EQ(greeted.lease_duration, welcome.lease_duration);
  EXPECT_EQ(greeted.farm, welcome.farm);
  EXPECT_EQ(greeted.worker, welcome.worker);

  const JobDescription job{JobId{3}, sha256("x"), example_settings()};
  const auto described = std::get<JobDescription>(through_wire(CoordinatorMessage(job)));
  EXPECT_EQ(described.job, JobId{3});
  EXPECT_EQ(described.render_digest, job.render_digest);
  expect_equal(described.settings, job.settings);

  const LeaseGrant grant{LeaseId{11}, {JobId{3}, {30, 0}, {TileId{1}, TileId{2}}}, {5, 6}, {sha256("a"), sha256("b")}};
  const auto granted = std::get<LeaseGrant>(through_wire(CoordinatorMessage(grant)));
  EXPECT_EQ(granted.lease, LeaseId{11});
  EXPECT_EQ(granted.unit, grant.unit);
  EXPECT_EQ(granted.trace, grant.trace);
  EXPECT_EQ(granted.tags, grant.tags);
  v1::WorkResponse fewer;
  to_wire(CoordinatorMessage(grant), &fewer);
  fewer.mutable_lease()->mutable_tags()->RemoveLast();
  EXPECT_NE(error_message(from_wire(fewer)).find("got 1 for 2 tiles"), std::string::npos);

  const ResultAck ack{{{JobId{1}, TileId{2}, {3, 4}}, {JobId{5}, TileId{6}, {0, 0}}}};
  EXPECT_EQ(std::get<ResultAck>(through_wire(CoordinatorMessage(ack))).keys, ack.keys);
  const LeaseCancel cancel{{LeaseId{1}, LeaseId{2}}};
  EXPECT_EQ(std::get<LeaseCancel>(through_wire(CoordinatorMessage(cancel))).leases, cancel.leases);
  const InspectionRequest files{{{"a/b.obj", sha256("b")}}, {"a/b.obj"}, "front"};
  const auto inspect = std::get<InspectGrant>(through_wire(
      CoordinatorMessage(InspectGrant{InspectionId{4}, std::make_shared<const InspectionRequest>(files)})));
  EXPECT_EQ(inspect.inspection, InspectionId{4});
  ASSERT_EQ(inspect.request->files.size(), 1u);
  EXPECT_EQ(inspect.request->files[0].path, "a/b.obj");
  EXPECT_EQ(inspect.request->files[0].digest, sha256("b"));
  EXPECT_EQ(inspect.request->scene, files.scene);
  EXPECT_EQ(inspect.request->camera, "front");
  const auto pilot = std::get<PilotGrant>(
      through_wire(CoordinatorMessage(PilotGrant{LeaseId{7}, JobId{3}, job.settings, {"path", "whitted"}, true})));
  EXPECT_TRUE(pilot.allocate);
  EXPECT_EQ(pilot.lease, LeaseId{7});
  EXPECT_EQ(pilot.job, JobId{3});
  EXPECT_EQ(pilot.settings.scene, job.settings.scene);
  EXPECT_EQ(pilot.methods, (std::vector<std::string>{"path", "whitted"}));
  EXPECT_TRUE(std::holds_alternative<DrainRequest>(through_wire(CoordinatorMessage(DrainRequest{}))));
  EXPECT_EQ(std::get<Dismissal>(through_wire(CoordinatorMessage(Dismissal{"twice"}))).reason, "twice");
}

TEST(Bytes, AHashKeepsItsCanonicalOrder) {
  const Hash128 hash = xxh3_128(as_byte_view("some bytes"));
  std::string hex;
  for (const char c : hash_bytes(hash)) {
    hex += fmt::format("{:02x}", static_cast<unsigned char>(c));
  }
  EXPECT_EQ(hex, hash.hex());
  EXPECT_EQ(*hash_from_bytes(hash_bytes(hash)), hash);
  EXPECT_EQ(*digest_from_bytes(digest_bytes(sha256("x"))), sha256("x"));
}

}  // namespace
}  // namespace lightmill::test
