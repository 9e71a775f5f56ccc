// Fuzz tests of messages: any bytes become a value within the stated limits, or an error.
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include "common/wire/farm_messages.h"
#include "lightmill/v1/worker_service.pb.h"
#include "tests/fuzz/fuzz_loop.h"
#include "tests/fuzz/wire_words.h"

namespace lightmill {
namespace {

const int kWireRounds = fuzz_cases(10'000);

RenderSettings example_settings() {
  RenderSettings settings;
  settings.scene = "scene";
  settings.assets = {Sha256{}};
  settings.width = settings.height = 128;
  settings.crop = {0, 0, 128, 128};
  settings.renderer_version = kRendererVersion;
  return settings;
}

const Unit kUnit{JobId{1}, {3, 2}, {TileId{0}, TileId{1}}};

template <class Wire, class Message>
void expect_survival(const std::vector<Message>& messages, std::uint64_t seed) {
  std::vector<std::string> originals;
  for (const Message& message : messages) {
    Wire wire;
    to_wire(message, &wire);
    originals.push_back(wire.SerializeAsString());
  }
  const google::protobuf::LogSilencer quiet;  // it reports each name that is not UTF-8
  const auto read = [](const std::string& original, FuzzRandom& random) -> std::optional<bool> {
    Wire wire;
    if (!wire.ParseFromString(mutate(original, kWireWords, random))) {
      return std::nullopt;
    }
    const Result<Message> message = from_wire(wire);
    if (!message.ok()) {
      EXPECT_FALSE(message_of(message.status()).empty());
      return false;
    }
    Wire again;
    to_wire(*message, &again);
    EXPECT_TRUE(from_wire(again).ok()) << from_wire(again).status();
    return true;
  };
  expect_both_outcomes(originals, seed, kWireRounds, read);
}

TEST(WireFuzz, DamagedWorkerMessagesBecomeValuesOrErrors) {
  WorkerResult result;
  result.key = {JobId{1}, TileId{2}, {3, 4}};
  result.node.range = result.key.range;
  result.node.values = {1, 2, 3, 4, 5, 6};
  result.hash = hash_of(result.node);
  Inspection found;
  found.scene = "packed";
  found.assets = {Sha256{}};
  found.notices = found.chosen = found.cameras = {"one", "two"};
  found.facts = {{"triangles", "12"}};
  found.methods = {{"path", true, "why"}};
  const std::vector<WorkerMessage> messages{
      WorkerHello{"w",
                  "h",
                  1,
                  2,
                  "class",
                  "version",
                  {{LeaseId{1}, 1, Sha256{}, kUnit, std::vector<Sha256>(kUnit.tiles.size())}},
                  false},
      WorkerHeartbeat{{LeaseId{1}, LeaseId{2}}},
      result,
      WorkerReturn{LeaseId{3}},
      WorkerRefusal{JobId{1}, "why"},
      WorkerDraining{},
      PilotReport{LeaseId{4}, 1, {"noise"}, 0.5, {}},
      InspectReport{InspectionId{5}, std::make_shared<const Inspection>(found)},
      InspectReport{InspectionId{6}, make_error(StatusCode::kInvalidArgument, "why")}};
  expect_survival<v1::WorkRequest>(messages, 6);
}

TEST(WireFuzz, DamagedCoordinatorMessagesBecomeValuesOrErrors) {
  const std::vector<CoordinatorMessage> messages{
      Welcome{1, std::chrono::seconds(2), std::chrono::seconds(10)},
      JobDescription{JobId{1}, Sha256{}, example_settings()},
      LeaseGrant{LeaseId{1}, kUnit, {}, std::vector<Sha256>(kUnit.tiles.size())},
      ResultAck{{{JobId{1}, TileId{2}, {3, 4}}}},
      LeaseCancel{{LeaseId{1}}},
      DrainRequest{},
      Dismissal{"why"},
      PilotGrant{LeaseId{1}, JobId{2}, {}, {"path", "whitted"}},
      InspectGrant{InspectionId{3}, std::make_shared<const InspectionRequest>(
                                        InspectionRequest{{{"a/b.obj", Sha256{}}}, {"a/b.obj"}, "camera"})}};
  expect_survival<v1::WorkResponse>(messages, 7);
}

TEST(WireFuzz, DamagedJobSpecificationsBecomeValuesOrErrors) {
  JobSpec spec;
  spec.request_id = "id";
  spec.goal.samples = 64;
  spec.settings = example_settings();
  const auto packed = [](const JobSpec& from) {
    v1::SubmitJobRequest request;
    to_wire(from, &request);
    return request.SerializeAsString();
  };
  const google::protobuf::LogSilencer quiet;
  expect_both_outcomes({packed(spec)}, 8, kWireRounds, [&](const std::string& original, FuzzRandom& random) {
    v1::SubmitJobRequest damaged, whole;
    if (!damaged.ParseFromString(mutate(original, kWireWords, random))) {
      return false;
    }
    const Result<JobSpec> read = from_wire(damaged);
    if (read.ok()) {
      EXPECT_TRUE(whole.ParseFromString(packed(*read)));
      const Result<JobSpec> again = from_wire(whole);
      EXPECT_TRUE(again.ok() && packed(*again) == packed(*read)) << again.status();
    }
    return read.ok();
  });
}

}  // namespace
}  // namespace lightmill
