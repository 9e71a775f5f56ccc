// Connections of a port: which are served, which wait, and which make room.
#include "server/access/connection_limiter.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lightmill {
namespace {

using Decision = ConnectionLimiter::Decision;

Time limiter_time(double seconds) {
  return Time{from_seconds(1'000 + seconds)};
}

std::string peer_of(const std::string& address, int port) {
  return fmt::format("{}:{}", address, port);
}

Identity person(const std::string& name, std::initializer_list<Role> roles) {
  return {name, Roles(roles), Proof::certificate, 0, ""};
}

/// `count` arrivals from one address, at ports 1, 2, …
std::vector<ConnectionLimiter::Arrival> arrive_from(ConnectionLimiter& limiter, const std::string& address, int count,
                                                    double seconds = 0) {
  std::vector<ConnectionLimiter::Arrival> arrivals;
  for (int port = 1; port <= count; ++port) {
    arrivals.push_back(limiter.arrive(peer_of(address, port), limiter_time(seconds)));
  }
  return arrivals;
}

std::size_t count_of(const std::vector<ConnectionLimiter::Arrival>& arrivals, Decision decision) {
  return static_cast<std::size_t>(std::ranges::count(arrivals, decision, &ConnectionLimiter::Arrival::decision));
}

TEST(ConnectionLimiterTest, UnknownCallersOfOneAddressGetAQuarterOfTheSlotsAndTheRestWait) {
  ConnectionLimiter limiter(40);
  const auto arrivals = arrive_from(limiter, "10.0.0.1", 15);
  EXPECT_EQ(count_of(arrivals, Decision::serve), 10u);
  EXPECT_EQ(count_of(arrivals, Decision::wait), 5u);
  EXPECT_EQ(limiter.arrive("10.0.0.2:1", limiter_time(0)).decision, Decision::serve)
      << "another address does not wait for them";
}

TEST(ConnectionLimiterTest, ANewConnectionToAFullPortDisplacesTheLargestAddress) {
  ConnectionLimiter limiter(40);
  const auto arrivals = arrive_from(limiter, "10.0.0.1", 40);
  const auto of_the_largest = limiter.arrive("10.0.0.1:99", limiter_time(1));
  EXPECT_EQ(of_the_largest.decision, Decision::wait);
  EXPECT_EQ(of_the_largest.close, arrivals[10].id) << "the oldest that waits";
  const auto arrival = limiter.arrive("10.0.0.2:1", limiter_time(1));
  EXPECT_EQ(arrival.decision, Decision::serve);
  EXPECT_EQ(arrival.close, arrivals[11].id);
  EXPECT_EQ(arrival.end, 0u);
  EXPECT_EQ(limiter.size(), 40u);
}

TEST(ConnectionLimiterTest, TheOldestUnknownCallerMakesRoomIfNoConnectionWaits) {
  ConnectionLimiter limiter(8);
  std::vector<ConnectionLimiter::Id> first;
  for (const std::string address : {"10.0.0.1", "10.0.0.2", "10.0.0.3", "10.0.0.4"}) {
    for (const ConnectionLimiter::Arrival& each : arrive_from(limiter, address, 2)) {
      EXPECT_EQ(each.decision, Decision::serve);
      first.push_back(each.id);
    }
  }
  const auto arrival = limiter.arrive("10.0.0.9:1", limiter_time(1));
  EXPECT_EQ(arrival.decision, Decision::serve);
  EXPECT_EQ(arrival.close, 0u);
  EXPECT_NE(std::ranges::find(first, arrival.end), first.end());
}

TEST(ConnectionLimiterTest, ConnectionsBeyondTheSlackAreRefusedUntilEndedOnesClose) {
  ConnectionLimiter limiter(8);
  for (int i = 0; i < 8; ++i) {
    (void)limiter.arrive(peer_of(fmt::format("10.0.{}.1", i / 2), i), limiter_time(0));
  }
  std::vector<ConnectionLimiter::Id> ended;
  for (int i = 0; i < 100; ++i) {
    const auto arrival = limiter.arrive(peer_of(fmt::format("10.1.{}.1", i), 1), limiter_time(0));
    if (arrival.end != 0) {
      ended.push_back(arrival.end);
    }
  }
  EXPECT_LE(limiter.size(), 8 + ConnectionLimiter::kSlack);
  EXPECT_FALSE(ended.empty());
  for (const ConnectionLimiter::Id id : ended) {
    limiter.leave(id);
  }
  EXPECT_LE(limiter.size(), 8u);
}

TEST(ConnectionLimiterTest, UnknownCallersTimeOutOnlyWhileOthersOfTheirAddressWait) {
  ConnectionLimiter limiter(40);
  const auto arrivals = arrive_from(limiter, "10.0.0.1", 10);
  EXPECT_TRUE(limiter.update(limiter_time(60)).end.empty()) << "no connection waits";
  const auto waiting = limiter.arrive("10.0.0.1:99", limiter_time(60));
  ASSERT_EQ(waiting.decision, Decision::wait);
  const ConnectionLimiter::Changes changes = limiter.update(limiter_time(60));
  EXPECT_EQ(changes.end, std::vector<ConnectionLimiter::Id>{arrivals[0].id}) << "one for the one that waits";
  EXPECT_EQ(changes.serve, std::vector<ConnectionLimiter::Id>{waiting.id});
  EXPECT_FALSE(limiter.has_waiting());
}

TEST(ConnectionLimiterTest, TheNewestWaitingConnectionIsServedNext) {
  ConnectionLimiter limiter(40);
  const auto arrivals = arrive_from(limiter, "10.0.0.1", 40);
  const auto arrival = limiter.arrive("10.0.0.1:99", limiter_time(1));
  limiter.leave(arrivals[0].id);
  EXPECT_EQ(limiter.update(limiter_time(2)).serve, std::vector<ConnectionLimiter::Id>{arrival.id});
  EXPECT_EQ(limiter.update(limiter_time(2)).serve, std::vector<ConnectionLimiter::Id>{});
}

TEST(ConnectionLimiterTest, AnUnknownCallerKeepsItsSlotForItsTime) {
  ConnectionLimiter limiter(40);
  (void)arrive_from(limiter, "10.0.0.1", 12, 10);
  const Time early = limiter_time(10) + ConnectionLimiter::kTimeout - std::chrono::milliseconds(1);
  EXPECT_TRUE(limiter.update(early).end.empty());
  EXPECT_TRUE(limiter.update(early).serve.empty());
  EXPECT_EQ(limiter.update(early + std::chrono::milliseconds(1)).end.size(), 2u) << "two wait";
}

TEST(ConnectionLimiterTest, AKnownCallerIsNotDisplaced) {
  ConnectionLimiter limiter(40);
  const Identity ada = person("ada", {Role::worker});
  (void)arrive_from(limiter, "10.0.0.1", 10);
  for (int port = 1; port <= 10; ++port) {
    EXPECT_TRUE(limiter.set_caller(peer_of("10.0.0.1", port), ada).ok());
  }
  EXPECT_EQ(limiter.arrive("10.0.0.1:11", limiter_time(0)).decision, Decision::serve);
  (void)arrive_from(limiter, "10.0.0.2", 60);
  for (int i = 0; i < 100; ++i) {
    const auto arrival = limiter.arrive(peer_of(fmt::format("10.1.{}.1", i), 1), limiter_time(0));
    EXPECT_TRUE(arrival.decision == Decision::refuse || arrival.close > 10 || arrival.end > 10) << "1 to 10 are known";
  }
}

TEST(ConnectionLimiterTest, ACertificatesWorkersGetThreeQuartersAndAPersonAnEighth) {
  ConnectionLimiter limiter(80);
  const Identity farm = person("farm", {Role::worker}), ada = person("ada", {Role::submit});
  int workers = 0, people = 0;
  for (int port = 1; port <= 80; ++port) {
    const std::string worker = peer_of("10.0.0.1", port);
    const ConnectionLimiter::Arrival arrival = limiter.arrive(worker, limiter_time(0));
    ASSERT_NE(arrival.decision, Decision::refuse);
    if (const Status met = limiter.set_caller(worker, farm); met.ok()) {
      ++workers;
    } else {
      EXPECT_EQ(met.code(), StatusCode::kResourceExhausted);
      limiter.leave(arrival.id);
    }
  }
  EXPECT_EQ(workers, 60);
  for (int port = 1; port <= 20; ++port) {
    const std::string peer = peer_of("10.0.0.2", port);
    const ConnectionLimiter::Arrival arrival = limiter.arrive(peer, limiter_time(0));
    if (arrival.decision == Decision::refuse || !limiter.set_caller(peer, ada).ok()) {
      limiter.leave(arrival.id);
    } else {
      ++people;
    }
  }
  EXPECT_EQ(people, 10);
}

TEST(ConnectionLimiterTest, AClosedConnectionFreesItsSlot) {
  ConnectionLimiter limiter(8);
  const Identity ada = person("ada", {Role::submit});
  const auto first = limiter.arrive("10.0.0.1:1", limiter_time(0));
  EXPECT_TRUE(limiter.set_caller("10.0.0.1:1", ada).ok());
  const auto second = limiter.arrive("10.0.0.1:2", limiter_time(0));
  EXPECT_EQ(limiter.set_caller("10.0.0.1:2", ada).code(), StatusCode::kResourceExhausted);
  limiter.leave(first.id);
  EXPECT_TRUE(limiter.set_caller("10.0.0.1:2", ada).ok());
  limiter.leave(second.id);
  limiter.leave(second.id);
  EXPECT_EQ(limiter.size(), 0u);
}

TEST(ConnectionLimiterTest, AReusedPortBelongsToTheNewConnection) {
  ConnectionLimiter limiter(8);
  const auto first = limiter.arrive("10.0.0.1:1", limiter_time(0));
  const auto second = limiter.arrive("10.0.0.1:1", limiter_time(1));
  EXPECT_EQ(limiter.size(), 1u);
  limiter.leave(first.id);
  EXPECT_EQ(limiter.size(), 1u) << "the end of the first does not end the second";
  limiter.leave(second.id);
  EXPECT_EQ(limiter.size(), 0u);
}

TEST(ConnectionLimiterTest, AClearedCallerIsUnknownAndFreesItsShare) {
  ConnectionLimiter limiter(40);
  const Identity ada = person("ada", {Role::submit});
  (void)arrive_from(limiter, "10.0.0.1", 6);
  for (int port = 1; port <= 5; ++port) {
    EXPECT_TRUE(limiter.set_caller(peer_of("10.0.0.1", port), ada).ok());
  }
  EXPECT_FALSE(limiter.set_caller("10.0.0.1:6", ada).ok());
  limiter.clear_caller("10.0.0.1:1", limiter_time(60));
  EXPECT_TRUE(limiter.set_caller("10.0.0.1:6", ada).ok());
  for (int port = 101; port <= 110; ++port) {
    (void)limiter.arrive(peer_of("10.0.0.1", port), limiter_time(60));  // the last one waits
  }
  const ConnectionLimiter::Changes changes = limiter.update(limiter_time(60));
  EXPECT_EQ(changes.end, std::vector<ConnectionLimiter::Id>{1}) << "it makes room at once";
  EXPECT_EQ(changes.serve.size(), 1u);
}

TEST(ConnectionLimiterTest, AnAddressWithAllSlotsMakesRoomForOthers) {
  ConnectionLimiter limiter(40);
  const Identity one = person("one", {Role::worker}), two = person("two", {Role::worker});
  for (int port = 1; port <= 40; ++port) {
    const std::string peer = peer_of("10.0.0.1", port);
    EXPECT_EQ(limiter.arrive(peer, limiter_time(0)).decision, Decision::serve);
    EXPECT_TRUE(limiter.set_caller(peer, port <= 30 ? one : two).ok());
  }
  EXPECT_EQ(limiter.arrive("10.0.0.1:99", limiter_time(0)).decision, Decision::refuse);
  const auto arrival = limiter.arrive("10.0.0.2:1", limiter_time(0));
  EXPECT_EQ(arrival.decision, Decision::serve);
  EXPECT_EQ(arrival.end, 40u) << "the newest";
  EXPECT_TRUE(limiter.set_caller("10.0.0.2:1", two).ok()) << "ended connections count for no caller";
  EXPECT_EQ(limiter.arrive("10.0.0.2:2", limiter_time(0)).end, 39u);
}

TEST(DescriptorPlanTest, AllPortsTogetherLeaveDescriptorsForTheProcess) {
  for (const std::uint64_t files : {128u, 256u, 1'024u, 65'536u, 1'048'576u}) {
    const DescriptorPlan plan = plan_descriptors(files);
    const std::size_t taken = plan.calls + plan.page + plan.health + plan.assets + 3 * ConnectionLimiter::kSlack;
    EXPECT_LE(taken + 16, files) << files;
    EXPECT_GE(plan.calls, 16u) << files;
  }
  EXPECT_GE(plan_descriptors(65'536).calls, 50'000u);
}

}  // namespace
}  // namespace lightmill
