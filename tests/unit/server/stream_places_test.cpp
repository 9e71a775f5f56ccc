// Places of calls that last, and which call ends for another.
#include "server/runtime/stream_places.h"

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

TEST(StreamPlaces, ACallerHasItsShareOfEachKind) {
  StandingClock clock;
  StreamPlaces places({1, 2, 100}, clock);
  const auto first = places.take(StreamKind::asset, kAda), second = places.take(StreamKind::asset, kAda);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(message_of(places.take(StreamKind::asset, kAda).status()),
            "the farm takes 2 assets under way of one caller (--caller-streams): try again when one has ended");
  EXPECT_TRUE(places.take(StreamKind::asset, kBob).ok());
  EXPECT_TRUE(places.take(StreamKind::film, kAda).ok());
}

TEST(StreamPlaces, APlaceIsFreeOnceItsLastCopyIsGone) {
  StandingClock clock;
  StreamPlaces places({1, 1, 100}, clock);
  auto place = places.take(StreamKind::page, kAda).value();
  auto copy = place;
  place.reset();
  EXPECT_FALSE(places.take(StreamKind::page, kAda).ok());
  copy.reset();
  EXPECT_TRUE(places.take(StreamKind::page, kAda).ok());
}

TEST(StreamPlaces, OneCallerDoesNotTakeAllFilms) {
  StandingClock clock;
  StreamPlaces places({1, 256, 100}, clock);
  std::vector<std::shared_ptr<StreamPlace>> held;
  std::vector<std::size_t> ended;
  for (std::size_t i = 0; i < StreamPlaces::kMostFilms; ++i) {
    held.push_back(places.take(StreamKind::film, kAda).value());
    held.back()->on_give_way([&ended, i] { ended.push_back(i); });
  }
  EXPECT_EQ(message_of(places.take(StreamKind::film, kAda).status()),
            "the farm has places for 64 films under way, and all are taken: try again later");
  EXPECT_TRUE(places.take(StreamKind::film, kBob).ok());
  EXPECT_EQ(ended, std::vector{StreamPlaces::kMostFilms - 1});
}

TEST(StreamPlaces, AStalledCallEndsForAnotherOfItsCaller) {
  StandingClock clock;
  StreamPlaces places({1, 2, 100}, clock);
  const auto silent = places.take(StreamKind::asset, kAda).value(), busy = places.take(StreamKind::asset, kAda).value();
  int ends = 0;
  silent->on_give_way([&ends] { ++ends; });
  busy->on_give_way([] { FAIL() << "it moves"; });
  silent->stands_still();
  busy->stands_still();
  clock.advance(Places::kPatience);
  busy->moves();
  EXPECT_TRUE(places.take(StreamKind::asset, kAda).ok());
  EXPECT_EQ(ends, 1);
}

TEST(StreamPlaces, AnEndedCallIsNotEndedAgain) {
  StandingClock clock;
  StreamPlaces places({1, 1, 100}, clock);
  const auto over = places.take(StreamKind::asset, kAda).value();
  over->on_give_way([] { FAIL() << "it has ended"; });
  over->stands_still();
  over->call_ended();
  clock.advance(Places::kPatience);
  EXPECT_TRUE(places.take(StreamKind::asset, kAda).ok());
}

TEST(StreamPlaces, ACallDisplacedBeforeItBeginsEndsWhenItBegins) {
  StandingClock clock;
  StreamPlaces places({1, 1, 100}, clock);
  const auto early = places.take(StreamKind::asset, kAda).value();
  early->stands_still();
  clock.advance(Places::kPatience);
  const auto other = places.take(StreamKind::asset, kAda);
  ASSERT_TRUE(other.ok());
  int ends = 0;
  early->on_give_way([&ends] { ++ends; });
  EXPECT_EQ(ends, 1);
}

TEST(StreamPlaces, LongCallsHaveAKind) {
  for (const RpcRule& rule : rpc_rules()) {
    const bool lasts = rule.method == "UploadAsset" || rule.method == "DownloadAsset" || rule.method == "WatchJob" ||
                       rule.method == "GetFilm" || rule.method == "StreamIsActive";
    EXPECT_EQ(stream_kind(rule.rpc).has_value(), lasts) << rule.method;
  }
}

}  // namespace
}  // namespace lightmill
