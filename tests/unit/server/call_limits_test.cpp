// Limits on the requests of one caller and of all callers.
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
            "the farm accepts 2 requests per second from one caller (--caller-requests): try again in 250 ms");
  EXPECT_TRUE(limits.take_request("bob", call_time(0.25)).ok());
  EXPECT_TRUE(limits.take_request("ada", call_time(0.5)).ok());
}

TEST(CallLimitsTest, EntriesOfListsCountAsRequests) {
  CallLimits limits({2, 1, 1});
  EXPECT_TRUE(limits.take_request("ada", call_time(0)).ok());
  limits.charge_entries("ada", CallLimits::kEntriesOfARequest - 1, call_time(0));
  EXPECT_TRUE(limits.take_request("ada", call_time(0)).ok()) << "a small page is one request";
  limits.charge_entries("ada", 20 * CallLimits::kEntriesOfARequest, call_time(0));  // 22 of 20
  EXPECT_FALSE(limits.take_request("ada", call_time(1.25)).ok());
  EXPECT_TRUE(limits.take_request("ada", call_time(1.75)).ok()) << "a debt of 2 and one token, at 2 a second";
  EXPECT_TRUE(limits.take_request("bob", call_time(0)).ok());
}

TEST(CallLimitsTest, ManyCallersTakeBoundedMemory) {
  CallLimits limits({1, 1, 100'000});
  for (int i = 0; i < 100'000; ++i) {
    limits.take_request(std::to_string(i), call_time(0)).IgnoreError();
  }
  EXPECT_EQ(limits.callers(), CallLimits::kMaxCallers);
  // Callers beyond the limit share the rate of one: ten at once, one a second.
  EXPECT_FALSE(limits.take_request("new", call_time(0.5)).ok());
  // Callers that stay away for long enough make room.
  EXPECT_TRUE(limits.take_request("newest", call_time(60)).ok());
  EXPECT_EQ(limits.callers(), 1u);
}

TEST(CallLimitsTest, ThePortDoesNotChangeTheCaller) {
  const Identity ada{"ada", {Role::submit}, Proof::certificate, 0, ""};
  EXPECT_EQ(caller_key(ada, "10.0.0.7:1"), caller_key(ada, "10.0.0.7:2"));
  EXPECT_NE(caller_key(ada, "10.0.0.7:1"), caller_key(ada, "10.0.0.8:1"));
  EXPECT_NE(caller_key(ada, "10.0.0.7:1"), caller_key(Identity{}, "10.0.0.7:1"));
  EXPECT_EQ(caller_key(Identity{}, "[2001:db8:1:2::1]:1"), caller_key(Identity{}, "[2001:db8:1:2::2]:2"))
      << "one machine has all addresses of its network";
}

}  // namespace
}  // namespace lightmill
