// What one caller may ask, and all together.
#include "server/access/call_limits.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

Time call_time(double seconds) {
  return Time{from_seconds(seconds)};
}

TEST(CallLimitsTest, RequestsOfOneCallerTakeNothingFromAnother) {
  CallLimits limits({2, 1, 1});
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(limits.take_request("ada", call_time(0)).ok()) << i;
  }
  const Status refused = limits.take_request("ada", call_time(0.25));
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(refused),
            "the farm takes 2 requests a second of one caller (--caller-requests): try again in 250 ms");
  EXPECT_TRUE(limits.take_request("bob", call_time(0.25)).ok());
  EXPECT_TRUE(limits.take_request("ada", call_time(0.5)).ok());
}

TEST(CallLimitsTest, StreamsHavePlacesOfEachCallerAndOfAll) {
  CallLimits limits({1, 2, 3});
  const std::string first = limits.open_stream("ada", call_time(0)).value();
  EXPECT_TRUE(limits.open_stream("ada", call_time(0)).ok());
  EXPECT_NE(message_of(limits.open_stream("ada", call_time(0)).status()).find("2 streams at once of one caller"),
            std::string::npos);
  EXPECT_TRUE(limits.open_stream("bob", call_time(0)).ok());
  EXPECT_NE(message_of(limits.open_stream("bob", call_time(0)).status()).find("all of its 3 streams"),
            std::string::npos);
  limits.close_stream(first);
  EXPECT_TRUE(limits.open_stream("bob", call_time(0)).ok());
  EXPECT_FALSE(limits.open_stream("ada", call_time(0)).ok());
}

TEST(CallLimitsTest, CallersWithoutNumberTakeNoMemoryWithoutEnd) {
  CallLimits limits({1, 1, 100'000});
  const std::string kept = limits.open_stream("ada", call_time(0)).value();
  for (int i = 0; i < 100'000; ++i) {
    limits.take_request(std::to_string(i), call_time(0)).IgnoreError();
  }
  EXPECT_EQ(limits.callers(), CallLimits::kMostCallers);
  // Those beyond share what one has: ten at once, one a second.
  EXPECT_FALSE(limits.take_request("new", call_time(0.5)).ok());
  const std::string place = limits.open_stream("new", call_time(0.5)).value();
  EXPECT_FALSE(limits.open_stream("newer", call_time(0.5)).ok());
  EXPECT_FALSE(limits.open_stream("ada", call_time(0.5)).ok());
  // Once they have been away for long enough, there is room again.
  EXPECT_TRUE(limits.take_request("newest", call_time(60)).ok());
  EXPECT_EQ(limits.callers(), 2u) << "the newest, and who has a stream";
  limits.close_stream(place);
  limits.close_stream(kept);
  EXPECT_TRUE(limits.open_stream("ada", call_time(60)).ok());
}

TEST(CallLimitsTest, WhatLastsHasAPlace) {
  for (const RpcRule& rule : rpc_rules()) {
    const bool lasts = rule.method == "UploadAsset" || rule.method == "DownloadAsset" || rule.method == "WatchJob" ||
                       rule.method == "GetFilm" || rule.method == "StreamIsActive";
    EXPECT_EQ(counts_as_stream(rule.rpc), lasts) << rule.method;
  }
}

TEST(CallLimitsTest, AnIdentityAtAnAddressIsOneWhateverThePort) {
  const Identity ada{"ada", {Role::submit}, Proof::certificate, 0, ""};
  EXPECT_EQ(caller_key(ada, "10.0.0.7:1"), caller_key(ada, "10.0.0.7:2"));
  EXPECT_NE(caller_key(ada, "10.0.0.7:1"), caller_key(ada, "10.0.0.8:1"));
  EXPECT_NE(caller_key(ada, "10.0.0.7:1"), caller_key(Identity{}, "10.0.0.7:1"));
  EXPECT_EQ(caller_key(Identity{}, "[::1]:1"), caller_key(Identity{}, "[::1]:2"));
}

}  // namespace
}  // namespace lightmill
