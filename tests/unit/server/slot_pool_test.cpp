// Slots that callers share: which caller gets one, and which makes room.
#include "server/access/slot_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace lightmill {
namespace {

using Answer = SlotPool::Answer;

constexpr Time kSlotsBegin{std::chrono::seconds(1'000)};

/// Takes slots until one is refused, 1,000 at most. Returns their number.
std::size_t take_all(SlotPool& slots, SlotPool::Id first, const Holder& holder, Time now = kSlotsBegin) {
  std::size_t acquired = 0;
  while (acquired < 1'000 && slots.acquire(first + acquired, holder, now).answer == Answer::acquired) {
    ++acquired;
  }
  return acquired;
}

TEST(SlotPool, OneHolderCanTakeAllFreeSlots) {
  SlotPool slots(100, 100);
  EXPECT_EQ(take_all(slots, 1, {"ada", "10.0.0.1"}), 100u);
  EXPECT_EQ(slots.acquire(101, {"ada", "10.0.0.1"}, kSlotsBegin).answer, Answer::full);
  EXPECT_EQ(slots.size(), 100u);
}

TEST(SlotPool, TheLargestHolderSharesEquallyWithAnotherCaller) {
  SlotPool slots(100, 100);
  const Holder flood{"ada", "10.0.0.1"}, bob{"bob", "10.0.0.2"};
  EXPECT_EQ(take_all(slots, 1, flood), 100u);
  for (SlotPool::Id id = 101; id <= 150; ++id) {
    const SlotPool::Arrival arrival = slots.acquire(id, bob, kSlotsBegin);
    EXPECT_EQ(arrival.answer, Answer::acquired) << id;
    EXPECT_EQ(arrival.evicted, 201 - id) << "the newest of the largest";
  }
  EXPECT_EQ(slots.acquire(151, bob, kSlotsBegin).answer, Answer::full) << "both have 50";
  EXPECT_EQ(slots.acquire(152, flood, kSlotsBegin).answer, Answer::full);
}

TEST(SlotPool, ManyNamesAtOneAddressAreHeldToOneShare) {
  SlotPool slots(60, 60);
  for (SlotPool::Id id = 1; id <= 60; ++id) {
    EXPECT_EQ(slots.acquire(id, {fmt::format("name {}", id), "10.0.0.1"}, kSlotsBegin).answer, Answer::acquired);
  }
  EXPECT_EQ(take_all(slots, 100, {"bob", "10.0.0.2"}), 20u)
      << "slot k + 1 of bob changes the sum of the squares of all counts by 6k - 118: it falls up to k = 19";
}

TEST(SlotPool, ManyAddressesOfOneNameAreHeldToOneShare) {
  SlotPool slots(60, 60);
  for (SlotPool::Id id = 1; id <= 60; ++id) {
    EXPECT_EQ(slots.acquire(id, {"ada", fmt::format("10.0.0.{}", id)}, kSlotsBegin).answer, Answer::acquired);
  }
  EXPECT_EQ(take_all(slots, 100, {"bob", "10.0.1.1"}), 20u);
}

TEST(SlotPool, CallersDoNotDisplaceEachOtherForever) {
  std::mt19937 random(7);
  SlotPool slots(40, 40);
  std::map<SlotPool::Id, Holder> held;
  std::vector<Holder> wanting;
  for (int i = 0; i < 12; ++i) {
    wanting.push_back({fmt::format("name {}", random() % 4), fmt::format("10.0.0.{}", random() % 4)});
  }
  SlotPool::Id id = 0;
  int given = 0;
  for (int i = 0; i < 20'000; ++i) {  // displaced callers come again
    const Holder holder = wanting[random() % wanting.size()];
    const SlotPool::Arrival arrival = slots.acquire(++id, holder, kSlotsBegin);
    if (arrival.answer == Answer::acquired) {
      held.emplace(id, holder);
      if (arrival.evicted) {
        ++given;
        wanting.push_back(held.at(*arrival.evicted));
        held.erase(*arrival.evicted);
      }
    }
    EXPECT_EQ(slots.size(), held.size());
  }
  EXPECT_GT(given, 0);
  EXPECT_LE(given, 1'600) << "the sum of squares is at most 3,200, and falls by at least 2";
}

TEST(SlotPool, AStalledHolderMakesRoomForAnyCaller) {
  SlotPool slots(3, 3);
  const Holder ada{"ada", "10.0.0.1"};
  EXPECT_EQ(take_all(slots, 1, ada), 3u);
  slots.set_stalled(1, kSlotsBegin);
  slots.set_stalled(2, kSlotsBegin + std::chrono::seconds(1));
  slots.set_stalled(3, kSlotsBegin);
  slots.set_active(3);
  const Time early = kSlotsBegin + SlotPool::kTimeout - std::chrono::nanoseconds(1);
  EXPECT_EQ(slots.acquire(4, ada, early).answer, Answer::full);
  EXPECT_EQ(slots.acquire(4, ada, early + std::chrono::nanoseconds(1)).evicted, 1u);
  EXPECT_EQ(slots.acquire(5, ada, early + std::chrono::nanoseconds(1)).answer, Answer::full)
      << "2 has a second left, and 3 has moved";
  slots.set_stalled(2, early);
  EXPECT_EQ(slots.acquire(5, ada, kSlotsBegin + 2 * SlotPool::kTimeout - std::chrono::seconds(1)).answer, Answer::full)
      << "2 has stalled again later";
}

TEST(SlotPool, ACallerAtItsShareReplacesItsOwnSlot) {
  SlotPool slots(10, 2);
  const Holder ada{"ada", "10.0.0.1"}, bob{"bob", "10.0.0.2"};
  EXPECT_EQ(take_all(slots, 1, ada), 2u);
  EXPECT_EQ(take_all(slots, 11, bob), 2u);
  slots.set_stalled(11, kSlotsBegin);
  const Time late = kSlotsBegin + 2 * SlotPool::kTimeout;
  EXPECT_EQ(slots.acquire(21, ada, late).answer, Answer::holder_limit);
  slots.set_stalled(2, kSlotsBegin);
  EXPECT_EQ(slots.acquire(21, ada, late).evicted, 2u);
}

TEST(SlotPool, AReleasedSlotIsFree) {
  SlotPool slots(1, 1);
  const Holder ada{"ada", "10.0.0.1"};
  EXPECT_EQ(slots.acquire(1, ada, kSlotsBegin).answer, Answer::acquired);
  slots.set_stalled(1, kSlotsBegin);
  slots.release(1);
  slots.release(1);
  EXPECT_FALSE(slots.holds(1));
  EXPECT_EQ(slots.acquire(2, ada, kSlotsBegin + 2 * SlotPool::kTimeout).evicted, std::nullopt);
  slots.set_stalled(1, kSlotsBegin);  // no effect, because it was released
  EXPECT_EQ(slots.acquire(3, ada, kSlotsBegin + 2 * SlotPool::kTimeout).answer, Answer::full);
}

TEST(SlotPool, ANetworkOfIPv6CountsAsOneAddress) {
  EXPECT_EQ(address_key("[2001:db8:1:2:3:4:5:6]:7350"), address_key("[2001:db8:1:2:9:9:9:9]:80"));
  EXPECT_NE(address_key("[2001:db8:1:2::1]:1"), address_key("[2001:db8:1:3::1]:1"));
  EXPECT_EQ(address_key("[fe80::1%2]:1"), address_key("[fe80::2%3]:1"));
  EXPECT_EQ(address_key("127.0.0.1:7350"), "127.0.0.1");
}

TEST(SlotPool, NamesOfDifferentProofsAreDifferentHolders) {
  const Identity certificate{"ada", {Role::submit}, Proof::certificate, 0, ""},
      token{"ada", {Role::submit}, Proof::token, 0, "1"};
  EXPECT_EQ(holder_of(certificate, "10.0.0.7:1"), holder_of(certificate, "10.0.0.7:2"));
  EXPECT_NE(holder_of(certificate, "10.0.0.7:1"), holder_of(token, "10.0.0.7:1"));
  EXPECT_NE(holder_of(certificate, "10.0.0.7:1"), holder_of(certificate, "10.0.0.8:1"));
  EXPECT_NE(holder_of(Identity{}, "10.0.0.7:1").name, holder_of(Identity{}, "10.0.0.8:1").name)
      << "unknown callers differ by their address alone";
}

}  // namespace
}  // namespace lightmill
