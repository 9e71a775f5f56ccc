// Connections of a port: which are served, which wait, and which make room.
#include "server/access/connection_book.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lightmill {
namespace {

using Fate = ConnectionBook::Fate;

Time book_time(double seconds) {
  return Time{from_seconds(1'000 + seconds)};
}

std::string peer_of(const std::string& address, int port) {
  return fmt::format("{}:{}", address, port);
}

Identity person(const std::string& name, std::initializer_list<Role> roles) {
  return {name, Roles(roles), Proof::certificate, 0, ""};
}

/// `count` arrivals from one address, at ports 1, 2, …
std::vector<ConnectionBook::Arrival> arrive_from(ConnectionBook& book, const std::string& address, int count,
                                                 double seconds = 0) {
  std::vector<ConnectionBook::Arrival> arrivals;
  for (int port = 1; port <= count; ++port) {
    arrivals.push_back(book.arrive(peer_of(address, port), book_time(seconds)));
  }
  return arrivals;
}

std::size_t count_of(const std::vector<ConnectionBook::Arrival>& arrivals, Fate fate) {
  return static_cast<std::size_t>(std::ranges::count(arrivals, fate, &ConnectionBook::Arrival::fate));
}

TEST(ConnectionBookTest, StrangersOfOneAddressGetAQuarterOfThePlacesAndTheRestWait) {
  ConnectionBook book(40);
  const auto arrivals = arrive_from(book, "10.0.0.1", 15);
  EXPECT_EQ(count_of(arrivals, Fate::serve), 10u);
  EXPECT_EQ(count_of(arrivals, Fate::wait), 5u);
  EXPECT_EQ(book.arrive("10.0.0.2:1", book_time(0)).fate, Fate::serve) << "another address waits for none of them";
}

TEST(ConnectionBookTest, NewcomersToAFullBookDisplaceTheLargestAddress) {
  ConnectionBook book(40);
  const auto arrivals = arrive_from(book, "10.0.0.1", 40);
  const auto of_the_largest = book.arrive("10.0.0.1:99", book_time(1));
  EXPECT_EQ(of_the_largest.fate, Fate::wait);
  EXPECT_EQ(of_the_largest.close, arrivals[10].id) << "the oldest that waits";
  const auto newcomer = book.arrive("10.0.0.2:1", book_time(1));
  EXPECT_EQ(newcomer.fate, Fate::serve);
  EXPECT_EQ(newcomer.close, arrivals[11].id);
  EXPECT_EQ(newcomer.end, 0u);
  EXPECT_EQ(book.size(), 40u);
}

TEST(ConnectionBookTest, TheOldestStrangerMakesRoomIfNoConnectionWaits) {
  ConnectionBook book(8);
  std::vector<ConnectionBook::Id> first;
  for (const std::string address : {"10.0.0.1", "10.0.0.2", "10.0.0.3", "10.0.0.4"}) {
    for (const ConnectionBook::Arrival& each : arrive_from(book, address, 2)) {
      EXPECT_EQ(each.fate, Fate::serve);
      first.push_back(each.id);
    }
  }
  const auto newcomer = book.arrive("10.0.0.9:1", book_time(1));
  EXPECT_EQ(newcomer.fate, Fate::serve);
  EXPECT_EQ(newcomer.close, 0u);
  EXPECT_NE(std::ranges::find(first, newcomer.end), first.end());
}

TEST(ConnectionBookTest, NewcomersBeyondTheSlackAreRefusedUntilEndedStrangersLeave) {
  ConnectionBook book(8);
  for (int i = 0; i < 8; ++i) {
    (void)book.arrive(peer_of(fmt::format("10.0.{}.1", i / 2), i), book_time(0));
  }
  std::vector<ConnectionBook::Id> ended;
  for (int i = 0; i < 100; ++i) {
    const auto newcomer = book.arrive(peer_of(fmt::format("10.1.{}.1", i), 1), book_time(0));
    if (newcomer.end != 0) {
      ended.push_back(newcomer.end);
    }
  }
  EXPECT_LE(book.size(), 8 + ConnectionBook::kSlack);
  EXPECT_FALSE(ended.empty());
  for (const ConnectionBook::Id id : ended) {
    book.leave(id);
  }
  EXPECT_LE(book.size(), 8u);
}

TEST(ConnectionBookTest, StrangersTimeOutOnlyWhileOthersOfTheirAddressWait) {
  ConnectionBook book(40);
  const auto arrivals = arrive_from(book, "10.0.0.1", 10);
  EXPECT_TRUE(book.look(book_time(60)).end.empty()) << "nobody waits";
  const auto waiting = book.arrive("10.0.0.1:99", book_time(60));
  ASSERT_EQ(waiting.fate, Fate::wait);
  const ConnectionBook::Changes changes = book.look(book_time(60));
  EXPECT_EQ(changes.end, std::vector<ConnectionBook::Id>{arrivals[0].id}) << "as many as are needed";
  EXPECT_EQ(changes.serve, std::vector<ConnectionBook::Id>{waiting.id});
  EXPECT_FALSE(book.somebody_waits());
}

TEST(ConnectionBookTest, TheNewestWaitingConnectionIsServedNext) {
  ConnectionBook book(40);
  const auto arrivals = arrive_from(book, "10.0.0.1", 40);
  const auto newcomer = book.arrive("10.0.0.1:99", book_time(1));
  book.leave(arrivals[0].id);
  EXPECT_EQ(book.look(book_time(2)).serve, std::vector<ConnectionBook::Id>{newcomer.id});
  EXPECT_EQ(book.look(book_time(2)).serve, std::vector<ConnectionBook::Id>{});
}

TEST(ConnectionBookTest, AStrangerKeepsItsPlaceForItsTime) {
  ConnectionBook book(40);
  (void)arrive_from(book, "10.0.0.1", 12, 10);
  const Time early = book_time(10) + ConnectionBook::kPatience - std::chrono::milliseconds(1);
  EXPECT_TRUE(book.look(early).end.empty());
  EXPECT_TRUE(book.look(early).serve.empty());
  EXPECT_EQ(book.look(early + std::chrono::milliseconds(1)).end.size(), 2u) << "two wait";
}

TEST(ConnectionBookTest, AKnownCallerIsNotDisplaced) {
  ConnectionBook book(40);
  const Identity ada = person("ada", {Role::worker});
  (void)arrive_from(book, "10.0.0.1", 10);
  for (int port = 1; port <= 10; ++port) {
    EXPECT_TRUE(book.meet(peer_of("10.0.0.1", port), ada).ok());
  }
  EXPECT_EQ(book.arrive("10.0.0.1:11", book_time(0)).fate, Fate::serve);
  (void)arrive_from(book, "10.0.0.2", 60);
  for (int i = 0; i < 100; ++i) {
    const auto newcomer = book.arrive(peer_of(fmt::format("10.1.{}.1", i), 1), book_time(0));
    EXPECT_TRUE(newcomer.fate == Fate::refuse || newcomer.close > 10 || newcomer.end > 10) << "1 to 10 are known";
  }
}

TEST(ConnectionBookTest, ACertificatesWorkersGetThreeQuartersAndAPersonAnEighth) {
  ConnectionBook book(80);
  const Identity farm = person("farm", {Role::worker}), ada = person("ada", {Role::submit});
  int workers = 0, people = 0;
  for (int port = 1; port <= 80; ++port) {
    const std::string worker = peer_of("10.0.0.1", port);
    const ConnectionBook::Arrival arrival = book.arrive(worker, book_time(0));
    ASSERT_NE(arrival.fate, Fate::refuse);
    if (const Status met = book.meet(worker, farm); met.ok()) {
      ++workers;
    } else {
      EXPECT_EQ(met.code(), StatusCode::kResourceExhausted);
      book.leave(arrival.id);
    }
  }
  EXPECT_EQ(workers, 60);
  for (int port = 1; port <= 20; ++port) {
    const std::string peer = peer_of("10.0.0.2", port);
    const ConnectionBook::Arrival arrival = book.arrive(peer, book_time(0));
    if (arrival.fate == Fate::refuse || !book.meet(peer, ada).ok()) {
      book.leave(arrival.id);
    } else {
      ++people;
    }
  }
  EXPECT_EQ(people, 10);
}

TEST(ConnectionBookTest, AClosedConnectionFreesItsPlace) {
  ConnectionBook book(8);
  const Identity ada = person("ada", {Role::submit});
  const auto first = book.arrive("10.0.0.1:1", book_time(0));
  EXPECT_TRUE(book.meet("10.0.0.1:1", ada).ok());
  const auto second = book.arrive("10.0.0.1:2", book_time(0));
  EXPECT_EQ(book.meet("10.0.0.1:2", ada).code(), StatusCode::kResourceExhausted);
  book.leave(first.id);
  EXPECT_TRUE(book.meet("10.0.0.1:2", ada).ok());
  book.leave(second.id);
  book.leave(second.id);
  EXPECT_EQ(book.size(), 0u);
}

TEST(ConnectionBookTest, AReusedPortBelongsToTheNewConnection) {
  ConnectionBook book(8);
  const auto first = book.arrive("10.0.0.1:1", book_time(0));
  const auto second = book.arrive("10.0.0.1:1", book_time(1));
  EXPECT_EQ(book.size(), 1u);
  book.leave(first.id);
  EXPECT_EQ(book.size(), 1u) << "the first one's end is not the second's";
  book.leave(second.id);
  EXPECT_EQ(book.size(), 0u);
}

TEST(ConnectionBookTest, ADepartedCallerIsAStrangerAndFreesItsShare) {
  ConnectionBook book(40);
  const Identity ada = person("ada", {Role::submit});
  (void)arrive_from(book, "10.0.0.1", 6);
  for (int port = 1; port <= 5; ++port) {
    EXPECT_TRUE(book.meet(peer_of("10.0.0.1", port), ada).ok());
  }
  EXPECT_FALSE(book.meet("10.0.0.1:6", ada).ok());
  book.part("10.0.0.1:1", book_time(60));
  EXPECT_TRUE(book.meet("10.0.0.1:6", ada).ok());
  for (int port = 101; port <= 110; ++port) {
    (void)book.arrive(peer_of("10.0.0.1", port), book_time(60));  // the last one waits
  }
  const ConnectionBook::Changes changes = book.look(book_time(60));
  EXPECT_EQ(changes.end, std::vector<ConnectionBook::Id>{1}) << "it makes room at once";
  EXPECT_EQ(changes.serve.size(), 1u);
}

TEST(ConnectionBookTest, AnAddressWithAllPlacesMakesRoomForOthers) {
  ConnectionBook book(40);
  const Identity one = person("one", {Role::worker}), two = person("two", {Role::worker});
  for (int port = 1; port <= 40; ++port) {
    const std::string peer = peer_of("10.0.0.1", port);
    EXPECT_EQ(book.arrive(peer, book_time(0)).fate, Fate::serve);
    EXPECT_TRUE(book.meet(peer, port <= 30 ? one : two).ok());
  }
  EXPECT_EQ(book.arrive("10.0.0.1:99", book_time(0)).fate, Fate::refuse);
  const auto newcomer = book.arrive("10.0.0.2:1", book_time(0));
  EXPECT_EQ(newcomer.fate, Fate::serve);
  EXPECT_EQ(newcomer.end, 40u) << "the newest";
  EXPECT_TRUE(book.meet("10.0.0.2:1", two).ok()) << "those that end count for nobody";
  EXPECT_EQ(book.arrive("10.0.0.2:2", book_time(0)).end, 39u);
}

TEST(DescriptorPlanTest, AllPortsTogetherLeaveDescriptorsForTheProcess) {
  for (const std::uint64_t files : {128u, 256u, 1'024u, 65'536u, 1'048'576u}) {
    const DescriptorPlan plan = plan_descriptors(files);
    const std::size_t taken = plan.calls + plan.page + plan.health + plan.assets + 3 * ConnectionBook::kSlack;
    EXPECT_LE(taken + 16, files) << files;
    EXPECT_GE(plan.calls, 16u) << files;
  }
  EXPECT_GE(plan_descriptors(65'536).calls, 50'000u);
}

}  // namespace
}  // namespace lightmill
