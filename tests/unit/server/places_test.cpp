// Places that callers share: which caller gets one, and which makes room.
#include "server/access/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace lightmill {
namespace {

using Answer = Places::Answer;

constexpr Time kPlacesBegin{std::chrono::seconds(1'000)};

/// Takes places until one is refused, 1,000 at most. Returns their number.
std::size_t take_all(Places& places, Places::Id first, const Holder& holder, Time now = kPlacesBegin) {
  std::size_t taken = 0;
  while (taken < 1'000 && places.arrive(first + taken, holder, now).answer == Answer::taken) {
    ++taken;
  }
  return taken;
}

TEST(Places, OneHolderCanTakeAllFreePlaces) {
  Places places(100, 100);
  EXPECT_EQ(take_all(places, 1, {"ada", "10.0.0.1"}), 100u);
  EXPECT_EQ(places.arrive(101, {"ada", "10.0.0.1"}, kPlacesBegin).answer, Answer::all_are_taken);
  EXPECT_EQ(places.size(), 100u);
}

TEST(Places, AnotherCallerGetsAsManyAsTheLargestHolderKeeps) {
  Places places(100, 100);
  const Holder flood{"ada", "10.0.0.1"}, bob{"bob", "10.0.0.2"};
  EXPECT_EQ(take_all(places, 1, flood), 100u);
  for (Places::Id id = 101; id <= 150; ++id) {
    const Places::Arrival arrival = places.arrive(id, bob, kPlacesBegin);
    EXPECT_EQ(arrival.answer, Answer::taken) << id;
    EXPECT_EQ(arrival.gives_way, 201 - id) << "the newest of the largest";
  }
  EXPECT_EQ(places.arrive(151, bob, kPlacesBegin).answer, Answer::all_are_taken) << "both have 50";
  EXPECT_EQ(places.arrive(152, flood, kPlacesBegin).answer, Answer::all_are_taken);
}

TEST(Places, ManyNamesAtOneAddressAreHeldToOneShare) {
  Places places(60, 60);
  for (Places::Id id = 1; id <= 60; ++id) {
    EXPECT_EQ(places.arrive(id, {fmt::format("name {}", id), "10.0.0.1"}, kPlacesBegin).answer, Answer::taken);
  }
  EXPECT_EQ(take_all(places, 100, {"bob", "10.0.0.2"}), 20u)
      << "with k, the address has 59 - 2k more than bob and one, and each name k fewer: 59 - 3k is positive up to 19";
}

TEST(Places, ManyAddressesOfOneNameAreHeldToOneShare) {
  Places places(60, 60);
  for (Places::Id id = 1; id <= 60; ++id) {
    EXPECT_EQ(places.arrive(id, {"ada", fmt::format("10.0.0.{}", id)}, kPlacesBegin).answer, Answer::taken);
  }
  EXPECT_EQ(take_all(places, 100, {"bob", "10.0.1.1"}), 20u);
}

TEST(Places, CallersDoNotDisplaceEachOtherForever) {
  std::mt19937 random(7);
  Places places(40, 40);
  std::map<Places::Id, Holder> held;
  std::vector<Holder> wanting;
  for (int i = 0; i < 12; ++i) {
    wanting.push_back({fmt::format("name {}", random() % 4), fmt::format("10.0.0.{}", random() % 4)});
  }
  Places::Id id = 0;
  int given = 0;
  for (int i = 0; i < 20'000; ++i) {  // displaced callers come again
    const Holder holder = wanting[random() % wanting.size()];
    const Places::Arrival arrival = places.arrive(++id, holder, kPlacesBegin);
    if (arrival.answer == Answer::taken) {
      held.emplace(id, holder);
      if (arrival.gives_way) {
        ++given;
        wanting.push_back(held.at(*arrival.gives_way));
        held.erase(*arrival.gives_way);
      }
    }
    EXPECT_EQ(places.size(), held.size());
  }
  EXPECT_GT(given, 0);
  EXPECT_LE(given, 1'600) << "the squares' sum is at most 3,200, and falls by two at least";
}

TEST(Places, AStalledHolderMakesRoomForAnyCaller) {
  Places places(3, 3);
  const Holder ada{"ada", "10.0.0.1"};
  EXPECT_EQ(take_all(places, 1, ada), 3u);
  places.stands_still(1, kPlacesBegin);
  places.stands_still(2, kPlacesBegin + std::chrono::seconds(1));
  places.stands_still(3, kPlacesBegin);
  places.moves(3);
  const Time early = kPlacesBegin + Places::kPatience - std::chrono::nanoseconds(1);
  EXPECT_EQ(places.arrive(4, ada, early).answer, Answer::all_are_taken);
  EXPECT_EQ(places.arrive(4, ada, early + std::chrono::nanoseconds(1)).gives_way, 1u);
  EXPECT_EQ(places.arrive(5, ada, early + std::chrono::nanoseconds(1)).answer, Answer::all_are_taken)
      << "2 has a second left, and 3 has moved";
  places.stands_still(2, early);
  EXPECT_EQ(places.arrive(5, ada, kPlacesBegin + 2 * Places::kPatience - std::chrono::seconds(1)).answer,
            Answer::all_are_taken)
      << "2 stands still anew";
}

TEST(Places, AHolderAtItsShareDisplacesOnlyItself) {
  Places places(10, 2);
  const Holder ada{"ada", "10.0.0.1"}, bob{"bob", "10.0.0.2"};
  EXPECT_EQ(take_all(places, 1, ada), 2u);
  EXPECT_EQ(take_all(places, 11, bob), 2u);
  places.stands_still(11, kPlacesBegin);
  const Time late = kPlacesBegin + 2 * Places::kPatience;
  EXPECT_EQ(places.arrive(21, ada, late).answer, Answer::holder_has_its_share);
  places.stands_still(2, kPlacesBegin);
  EXPECT_EQ(places.arrive(21, ada, late).gives_way, 2u);
}

TEST(Places, ALeftPlaceIsFree) {
  Places places(1, 1);
  const Holder ada{"ada", "10.0.0.1"};
  EXPECT_EQ(places.arrive(1, ada, kPlacesBegin).answer, Answer::taken);
  places.stands_still(1, kPlacesBegin);
  places.leave(1);
  places.leave(1);
  EXPECT_FALSE(places.holds(1));
  EXPECT_EQ(places.arrive(2, ada, kPlacesBegin + 2 * Places::kPatience).gives_way, std::nullopt);
  places.stands_still(1, kPlacesBegin);  // no effect, because it is gone
  EXPECT_EQ(places.arrive(3, ada, kPlacesBegin + 2 * Places::kPatience).answer, Answer::all_are_taken);
}

TEST(Places, ANetworkOfIPv6CountsAsOneAddress) {
  EXPECT_EQ(address_key("[2001:db8:1:2:3:4:5:6]:7350"), address_key("[2001:db8:1:2:9:9:9:9]:80"));
  EXPECT_NE(address_key("[2001:db8:1:2::1]:1"), address_key("[2001:db8:1:3::1]:1"));
  EXPECT_EQ(address_key("[fe80::1%2]:1"), address_key("[fe80::2%3]:1"));
  EXPECT_EQ(address_key("127.0.0.1:7350"), "127.0.0.1");
}

TEST(Places, NamesOfDifferentProofsAreDifferentHolders) {
  const Identity certificate{"ada", {Role::submit}, Proof::certificate, 0, ""},
      token{"ada", {Role::submit}, Proof::token, 0, "1"};
  EXPECT_EQ(holder_of(certificate, "10.0.0.7:1"), holder_of(certificate, "10.0.0.7:2"));
  EXPECT_NE(holder_of(certificate, "10.0.0.7:1"), holder_of(token, "10.0.0.7:1"));
  EXPECT_NE(holder_of(certificate, "10.0.0.7:1"), holder_of(certificate, "10.0.0.8:1"));
  EXPECT_NE(holder_of(Identity{}, "10.0.0.7:1").name, holder_of(Identity{}, "10.0.0.8:1").name)
      << "who is not known is told apart by the address alone";
}

}  // namespace
}  // namespace lightmill
