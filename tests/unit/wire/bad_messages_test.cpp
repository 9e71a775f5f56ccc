// Messages that break a rule are refused, and the error names the field.
#include <gtest/gtest.h>

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/limits.h"
#include "lightmill/v1/farm.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/worker_service.pb.h"
#include "tests/support/error_message.h"
#include "tests/unit/wire/example_messages.h"

namespace lightmill::test {
namespace {

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
  EXPECT_EQ(refused([](auto& w) { w.set_meters(kMaxMeters + 1); }), "settings.meters: must be at most 256, got 257");
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
  EXPECT_EQ(error_message(from_wire(goal)), "goal.samples: must be at most 1073741824, got 1073741825");
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

}  // namespace
}  // namespace lightmill::test
