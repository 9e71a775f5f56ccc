// Log of refusals: repeated ones take a line an hour, and a flood leaves a few lines.
#include "server/access/refusal_log.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr Rpc kCancel{kRenderService, "CancelJob", Right::control_job, true};
constexpr Rpc kPause{kRenderService, "PauseJob", Right::control_job, true};
constexpr Rpc kDrain{kRenderService, "DrainWorker", Right::control_farm, true};

Time at(double seconds) {
  return Time{from_seconds(seconds)};
}

Call call_of(const std::string& name, const Rpc& rpc = kWork, const std::string& peer = "10.0.0.7:4711") {
  Call call;
  call.caller.name = name;
  call.caller.proof = name.empty() ? Proof::none : Proof::token;
  call.rpc = rpc;
  call.peer = peer;
  return call;
}

const Status kRevoked = make_error(StatusCode::kUnauthenticated, "revoked");

TEST(RefusalLogTest, EqualRefusalsAreWrittenOnceAnHourWithTheirCount) {
  RefusalLog log;
  const std::optional<SuppressedRefusals> first = log.take(call_of("render-1"), {}, kRevoked, at(0));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->repeated, 0u);
  for (int minute = 1; minute < 60; ++minute) {  // from another port each time, as connections are
    const std::string peer = "10.0.0.7:" + std::to_string(5'000 + minute);
    EXPECT_FALSE(log.take(call_of("render-1", kWork, peer), {}, kRevoked, at(60.0 * minute))) << minute;
  }
  const std::optional<SuppressedRefusals> again = log.take(call_of("render-1"), {}, kRevoked, at(3'600));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->repeated, 59u);
  EXPECT_EQ(again->left_out, 0u);
  EXPECT_FALSE(log.take(call_of("render-1"), {}, kRevoked, at(3'601)));
}

TEST(RefusalLogTest, DifferentRefusalsAreWrittenSeparately) {
  RefusalLog log;
  EXPECT_TRUE(log.take(call_of("ada", kCancel), {7}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("ada", kCancel), {8}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("ada", kPause), {7}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("bob", kCancel), {7}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("ada", kCancel, "10.0.0.8:1"), {7}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("ada", kDrain), {0, "w1"}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("ada", kDrain), {0, "w2"}, kRevoked, at(0)));
  EXPECT_TRUE(log.take(call_of("ada", kCancel), {7}, make_error(StatusCode::kPermissionDenied, "its role"), at(0)));
  EXPECT_FALSE(log.take(call_of("ada", kCancel), {7}, kRevoked, at(0)));
}

TEST(RefusalLogTest, AFloodLeavesAHundredThenTenAMinuteOfKnownAndUnknownCallers) {
  RefusalLog log;
  const auto written = [&](const std::string& name, double from, int count) {
    int lines = 0;
    for (int i = 0; i < count; ++i) {
      lines += log.take(call_of(name), {static_cast<std::uint64_t>(from) + i + 1}, kRevoked, at(from)) ? 1 : 0;
    }
    return lines;
  };
  EXPECT_EQ(written("", 0, 5'000), 100);
  EXPECT_EQ(written("ada", 0, 50), 50);
  EXPECT_EQ(written("", 60'000, 1), 1) << "all the time since";
  EXPECT_EQ(written("", 60'000, 5'000), 99);
  const std::optional<SuppressedRefusals> later = log.take(call_of(""), {1'000'000}, kRevoked, at(60'006.5));
  ASSERT_TRUE(later) << "ten a minute are one in 6 s";
  EXPECT_EQ(later->left_out, 5'000u - 99 - 1) << "the one before was the same as the first of these";
}

}  // namespace
}  // namespace lightmill
