// Slots of long calls, and which call ends for another.
#include "server/runtime/stream_slots.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

class StandingClock final : public Clock {
 public:
  Time now() const override { return now_; }
  std::int64_t unix_milliseconds() const override { return 0; }
  void advance(Duration time) { now_ += time; }

 private:
  Time now_{std::chrono::seconds(1'000)};
};

const Holder kAda{"ada", "10.0.0.1"}, kBob{"bob", "10.0.0.2"};

TEST(StreamSlots, ACallerHasItsShareOfEachKind) {
  StandingClock clock;
  StreamSlots slots({1, 2, 100}, clock);
  const auto first = slots.take(StreamKind::asset, kAda), second = slots.take(StreamKind::asset, kAda);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(message_of(slots.take(StreamKind::asset, kAda).status()),
            "the farm takes 2 asset transfers of one caller (--caller-streams): try again when one has ended");
  EXPECT_TRUE(slots.take(StreamKind::asset, kBob).ok());
  EXPECT_TRUE(slots.take(StreamKind::film, kAda).ok());
}

TEST(StreamSlots, ASlotIsFreeOnceItsLastCopyIsDestroyed) {
  StandingClock clock;
  StreamSlots slots({1, 1, 100}, clock);
  auto slot = slots.take(StreamKind::page, kAda).value();
  auto copy = slot;
  slot.reset();
  EXPECT_FALSE(slots.take(StreamKind::page, kAda).ok());
  copy.reset();
  EXPECT_TRUE(slots.take(StreamKind::page, kAda).ok());
}

TEST(StreamSlots, OneCallerDoesNotTakeAllFilms) {
  StandingClock clock;
  StreamSlots slots({1, 256, 100}, clock);
  std::vector<std::shared_ptr<StreamSlot>> held;
  std::vector<std::size_t> ended;
  for (std::size_t i = 0; i < StreamSlots::kMaxFilms; ++i) {
    held.push_back(slots.take(StreamKind::film, kAda).value());
    held.back()->on_evict([&ended, i] { ended.push_back(i); });
  }
  EXPECT_EQ(message_of(slots.take(StreamKind::film, kAda).status()),
            "the farm serves at most 64 film transfers at a time: try again later");
  EXPECT_TRUE(slots.take(StreamKind::film, kBob).ok());
  EXPECT_EQ(ended, std::vector{StreamSlots::kMaxFilms - 1});
}

TEST(StreamSlots, AStalledCallEndsForAnotherOfItsCaller) {
  StandingClock clock;
  StreamSlots slots({1, 2, 100}, clock);
  const auto silent = slots.take(StreamKind::asset, kAda).value(), busy = slots.take(StreamKind::asset, kAda).value();
  int ends = 0;
  silent->on_evict([&ends] { ++ends; });
  busy->on_evict([] { FAIL() << "it is active"; });
  silent->set_stalled();
  busy->set_stalled();
  clock.advance(SlotPool::kTimeout);
  busy->set_active();
  EXPECT_TRUE(slots.take(StreamKind::asset, kAda).ok());
  EXPECT_EQ(ends, 1);
}

TEST(StreamSlots, AnEndedCallFreesItsSlotAtOnce) {
  StandingClock clock;
  StreamSlots slots({1, 1, 100}, clock);
  const auto over = slots.take(StreamKind::asset, kAda).value();
  over->on_evict([] { FAIL() << "it has ended"; });
  over->set_stalled();
  over->call_ended();
  EXPECT_TRUE(slots.take(StreamKind::asset, kAda).ok());
}

TEST(StreamSlots, ACallDisplacedBeforeItBeginsEndsWhenItBegins) {
  StandingClock clock;
  StreamSlots slots({1, 1, 100}, clock);
  const auto early = slots.take(StreamKind::asset, kAda).value();
  early->set_stalled();
  clock.advance(SlotPool::kTimeout);
  const auto other = slots.take(StreamKind::asset, kAda);
  ASSERT_TRUE(other.ok());
  int ends = 0;
  early->on_evict([&ends] { ++ends; });
  EXPECT_EQ(ends, 1);
}

}  // namespace
}  // namespace lightmill
