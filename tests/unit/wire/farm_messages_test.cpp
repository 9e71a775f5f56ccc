#include "common/wire/farm_messages.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/wire/bytes.h"
#include "common/wire/limits.h"
#include "lightmill/v1/farm.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/worker_service.pb.h"
#include "tests/support/error_message.h"

namespace lightmill {
namespace {

RenderSettings example_settings() {
  RenderSettings settings;
  settings.scene = std::string("scene\0bytes", 11);
  std::vector<Sha256> assets{sha256("a"), sha256("b")};
  std::ranges::sort(assets);
  settings.assets = assets;
  settings.width = 640;
  settings.height = 480;
  settings.crop = {10, 20, 630, 460};
  settings.layers = {{"beauty", 3, LayerKind::summed},
                     {"direct", 3, LayerKind::summed},
                     {"normal", 3, LayerKind::first_mean},
                     {"depth", 1, LayerKind::first_nearest},
                     {"id", 1, LayerKind::first_samples}};
  settings.meters = 3;
  settings.seed = std::numeric_limits<std::uint64_t>::max();
  settings.method = "path";
  settings.max_bounces = 7;
  settings.renderer_version = kRendererVersion;
  return settings;
}

JobSpec example_spec() {
  JobSpec spec;
  spec.request_id = "request-1";
  spec.name = "box";
  spec.owner = "ada";
  spec.host = "engine";
  spec.parent = JobId{17};
  spec.priority = -3;
  spec.goal = {300, 12.5, 0.0123, true};
  spec.settings = example_settings();
  return spec;
}

void expect_equal(const RenderSettings& a, const RenderSettings& b) {
  EXPECT_EQ(render_digest(a, "class"), render_digest(b, "class"));
  EXPECT_EQ(a.crop, b.crop);
  EXPECT_EQ(a.layers, b.layers);
  EXPECT_EQ(a.meters, b.meters);
}

WorkerResult example_result() {
  WorkerResult result;
  result.lease = LeaseId{9};
  result.key = {JobId{4}, TileId{63}, {3, 5}};
  result.node.range = result.key.range;
  result.node.values = {0.0f, 1.5f, -2.25f, std::numeric_limits<float>::denorm_min(), 3e38f, 7.0f};
  result.node.non_finite = 2;
  result.hash = hash_of(result.node);
  result.render_digest = sha256("job");
  result.seconds = 0.25;
  result.trace = {3, 4};
  result.tag = sha256("tag");
  return result;
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

using test::error_message;

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
  EXPECT_EQ(back->goal, spec.goal);
  expect_equal(back->settings, spec.settings);
  v1::SubmitJobRequest again;
  to_wire(*back, &again);
  EXPECT_EQ(again.SerializeAsString(), wire.SerializeAsString());
}

TEST(FarmMessages, AJobHasEveryFieldOfItsStatus) {
  JobStatus status;
  status.id = JobId{5};
  status.name = "box";
  status.owner = "ada";
  status.host = "engine";
  status.method = "path";
  status.method_notes = {true, {"one", "two"}, {"path: some light is missing"}, {"path", "whitted"}};
  status.fingerprint_class = "zen";
  status.parent = JobId{2};
  status.reason = "samples";
  status.priority = 4;
  status.goal = {64, 0, 0.5};
  status.reached = GoalLimit::error;
  status.width = 512;
  status.height = 256;
  status.crop = {0, 0, 512, 255};
  status.layers = {"direct", "light:key", "light:rest", "depth"};
  status.seed = 99;
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
  status.verify_share = 0.25;
  status.allow_mixed = true;
  status.one_identity = true;
  status.results_unverified = 8;
  status.audits_lost = 9;
  status.submitted_unix_ms = 1'700'000'000'000;
  status.finished_unix_ms = 1'700'000'000'001;
  status.render_digest = sha256("digest");
  status.trace = trace_id("request");
  for (const JobState state :
       {JobState::queued, JobState::running, JobState::paused, JobState::done, JobState::failed, JobState::cancelled}) {
    status.state = state;
    v1::Job job;
    to_wire(status, &job);
    const google::protobuf::Reflection& fields = *v1::Job::GetReflection();
    for (int i = 0; i < v1::Job::descriptor()->field_count(); ++i) {
      const google::protobuf::FieldDescriptor* field = v1::Job::descriptor()->field(i);
      EXPECT_TRUE(field->is_repeated() ? fields.FieldSize(job, field) > 0 : fields.HasField(job, field))
          << field->name();
    }
    EXPECT_EQ(from_wire(job.state()).value(), state);
    EXPECT_EQ(from_wire(job.method_notes()).value(), status.method_notes);
    EXPECT_EQ(from_wire(job.goal()).value(), status.goal);
    EXPECT_EQ(from_wire(job.reached()).value(), GoalLimit::error);
    EXPECT_EQ(from_wire(job.crop()).value(), status.crop);
    EXPECT_EQ(job.error().half_width(), 0.001);
    ASSERT_EQ(job.history_size(), 2);
    EXPECT_EQ(from_wire(job.history(1)), status.history[1]);
    const JobCounters counters = from_wire(job.counters());
    EXPECT_EQ(counters.non_finite, 5u);
    EXPECT_EQ(counters.nodes_dropped, 7u);
    EXPECT_EQ(digest_from_bytes(job.render_digest()).value(), status.render_digest);
    EXPECT_EQ(hash_from_bytes(job.trace_id()).value(), status.trace);
    for (const char* text :
         {"id: 5 name: \"box\" owner: \"ada\" host: \"engine\" method: \"path\" fingerprint_class: \"zen\" parent: 2",
          "reason: \"samples\" priority: 4", "width: 512 height: 256", "seed: 99 samples_done: 10 samples_wanted: 20",
          "min_tile_samples: 1 max_tile_samples: 3 active_seconds: 1.5 worker_seconds: 2.5",
          "samples_per_second: 1000000 eta_seconds: -1", "submitted_unix_ms: 1700000000000",
          "finished_unix_ms: 1700000000001", "frame_samples: 2 verify_share: 0.25 results_unverified: 8",
          "layers: \"direct\" layers: \"light:key\" layers: \"light:rest\" layers: \"depth\" allow_mixed: true",
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

TEST(FarmMessages, CoordinatorMessagesSurviveARoundTrip) {
  const Welcome welcome{42, std::chrono::milliseconds(2500), std::chrono::seconds(10), {7, 8}};
  const auto greeted = std::get<Welcome>(through_wire(CoordinatorMessage(welcome)));
  EXPECT_EQ(greeted.epoch, 42u);
  EXPECT_EQ(greeted.heartbeat_interval, welcome.heartbeat_interval);
  EXPECT_EQ(greeted.lease_duration, welcome.lease_duration);
  EXPECT_EQ(greeted.farm, welcome.farm);

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
  EXPECT_NE(error_message(from_wire(fewer)).find("1 of 2 tiles"), std::string::npos);

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

TEST(FarmMessages, BadRangesAreNamed) {
  v1::SampleRange range;
  range.set_level(31);
  EXPECT_EQ(error_message(from_wire(range)), "range.level: must be at most 30, got 31");
  range.set_level(30);
  range.set_index(1);
  EXPECT_EQ(error_message(from_wire(range)), "range.index: 1 at level 30 is beyond sample 1073741824");
  range.set_index(0);
  EXPECT_TRUE(from_wire(range).ok());
  range.set_level(0);
  range.set_index((1u << 30) - 1);
  EXPECT_TRUE(from_wire(range).ok());
  range.set_index(1u << 30);
  EXPECT_FALSE(from_wire(range).ok());
}

TEST(FarmMessages, BadSettingsAreNamed) {
  const auto refused = [](const auto& change) {
    v1::RenderSettings wire;
    to_wire(example_settings(), &wire);
    change(wire);
    return error_message(from_wire(wire));
  };
  EXPECT_EQ(refused([](auto& w) { w.set_width(0); }), "settings: width and height must be 1 to 65536, got 0x480");
  EXPECT_EQ(refused([](auto& w) { w.set_height(65537); }),
            "settings: width and height must be 1 to 65536, got 640x65537");
  EXPECT_EQ(refused([](auto& w) { w.mutable_crop()->set_x(11); }),
            "settings.crop: 11,20 630x460 does not lie within 640x480 pixels");
  EXPECT_EQ(refused([](auto& w) { w.mutable_crop()->set_width(std::numeric_limits<int>::max()); }),
            "rectangle numbers must be 0 to 65536, got x 10, y 20, width 2147483647, height 460");
  EXPECT_EQ(refused([](auto& w) { w.mutable_crop()->set_width(0); }),
            "settings.crop: 10,20 0x460 does not lie within 640x480 pixels");
  EXPECT_EQ(refused([](auto& w) { w.clear_crop(); }), "settings.crop: 0,0 0x0 does not lie within 640x480 pixels");
  EXPECT_EQ(refused([](auto& w) { w.set_assets(1, "short"); }), "settings.assets[1]: a SHA-256 has 32 bytes, got 5");
  EXPECT_EQ(refused([](auto& w) { w.mutable_assets()->SwapElements(0, 1); }),
            "settings.assets[1]: digests must be sorted, each once");
  EXPECT_EQ(refused([](auto& w) { w.set_assets(1, w.assets(0)); }),
            "settings.assets[1]: digests must be sorted, each once");
  EXPECT_EQ(refused([](auto& w) { w.clear_layers(); }), "settings.layers: 1 to 64 are expected, got 0");
  EXPECT_EQ(refused([](auto& w) { w.mutable_layers(0)->set_channels(89); }),
            "settings.layers: 97 channels in all are more than the limit of 96");
  EXPECT_EQ(refused([](auto& w) { w.mutable_layers(0)->set_channels(0); }),
            "settings.layers: a layer needs a name and at least one channel, got 'beauty' with 0");
  EXPECT_EQ(refused([](auto& w) { w.mutable_layers(0)->clear_kind(); }),
            "settings.layers: kind of 'beauty': unknown value 0");
  EXPECT_EQ(refused([](auto& w) { w.set_meters(kMaxMeters + 1); }), "settings.meters: at most 256, got 257");
  EXPECT_EQ(refused([](auto& w) { w.set_method(std::string(2000, 'x')); }),
            "settings.method: 2000 bytes are more than the limit of 1024");
}

TEST(FarmMessages, BadGoalsAreNamed) {
  v1::Goal goal;
  goal.set_seconds(-1);
  EXPECT_EQ(error_message(from_wire(goal)), "goal.seconds: must be more than 0 and at most 1000000000, got -1");
  goal.set_seconds(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(error_message(from_wire(goal)), "goal.seconds: must be more than 0 and at most 1000000000, got nan");
  goal.set_seconds(0);
  goal.set_error(-0.5);
  EXPECT_EQ(error_message(from_wire(goal)), "goal.error: must be finite and at least 1e-12, got -0.5");
  goal.set_error(std::numeric_limits<double>::infinity());
  EXPECT_EQ(error_message(from_wire(goal)), "goal.error: must be finite and at least 1e-12, got inf");
  goal.set_error(0);
  goal.set_samples(kMaxSamples + 1);
  EXPECT_EQ(error_message(from_wire(goal)), "goal.samples: at most 1073741824, got 1073741825");
}

TEST(FarmMessages, APilotWithoutMethodsIsRefused) {
  v1::WorkResponse wire;
  to_wire(CoordinatorMessage(PilotGrant{LeaseId{7}, JobId{3}, example_settings(), {}, true}), &wire);
  EXPECT_EQ(error_message(from_wire(wire)), "pilot.methods: at least one is expected");
}

TEST(FarmMessages, BadResultsAreNamed) {
  const auto refused = [](const auto& change) {
    v1::WorkRequest wire;
    to_wire(WorkerMessage(example_result()), &wire);
    change(*wire.mutable_result());
    return error_message(from_wire(wire));
  };
  EXPECT_EQ(refused([](auto& w) { w.set_values("12345"); }), "float values take a multiple of 4 bytes, got 5");
  const std::vector<float> infinite{1, std::numeric_limits<float>::infinity()};
  EXPECT_EQ(refused([&](auto& w) { w.set_values(float_bytes(infinite)); }), "values: a node's sums must be finite");
  const std::vector<float> nan{std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(refused([&](auto& w) { w.set_values(float_bytes(nan)); }), "values: a node's sums must be finite");
  EXPECT_EQ(refused([](auto& w) { w.set_values(std::string(4'000'000, '\0')); }),
            "values: 4000000 bytes are more than the limit of 3145728");
  EXPECT_EQ(refused([](auto& w) { w.set_hash("x"); }), "an XXH3-128 has 16 bytes, got 1");
  EXPECT_EQ(refused([](auto& w) { w.set_seconds(-0.5); }), "seconds: must be finite and not negative, got -0.5");
  EXPECT_EQ(refused([](auto& w) { w.mutable_key()->mutable_range()->set_level(40); }),
            "range.level: must be at most 30, got 40");
}

TEST(FarmMessages, OtherBadMessagesAreNamed) {
  EXPECT_EQ(error_message(from_wire(v1::WorkRequest())), "unknown kind of worker message");
  EXPECT_EQ(error_message(from_wire(v1::WorkResponse())), "unknown kind of coordinator message");
  v1::WorkRequest hello;
  to_wire(WorkerMessage(WorkerHello{}), &hello);
  EXPECT_EQ(error_message(from_wire(hello)), "hello.name: must not be empty");
  v1::WorkResponse welcome;
  welcome.mutable_welcome()->mutable_lease_duration()->set_seconds(-1);
  EXPECT_EQ(error_message(from_wire(welcome)),
            "welcome.lease_duration: must be between 0 and 86400 s, got -1 s and 0 ns");
  v1::SubmitJobRequest submit;
  EXPECT_EQ(error_message(from_wire(submit)), "request_id: must not be empty");
  v1::WorkRequest heartbeat;
  heartbeat.mutable_heartbeat()->mutable_leases()->Resize(static_cast<int>(kMaxListedLeases) + 1, 1);
  EXPECT_EQ(error_message(from_wire(heartbeat)), "leases: 10001 entries are more than the limit of 10000");
  for (const int seconds : {-1, 86401}) {
    heartbeat.mutable_heartbeat()->clear_leases();
    heartbeat.mutable_heartbeat()->mutable_longest_wait()->set_seconds(seconds);
    EXPECT_EQ(error_message(from_wire(heartbeat)),
              fmt::format("heartbeat.longest_wait: must be between 0 and 86400 s, got {} s and 0 ns", seconds));
  }
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
}  // namespace lightmill
