#include "server/listen/unread_bytes.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr std::uint64_t kMiB = 1 << 20;
const Time now = Time(std::chrono::seconds(1000));
using Ids = std::vector<UnreadBytes::Id>;

std::vector<UnreadBytes::Received> received(const std::vector<std::tuple<UnreadBytes::Id, std::string, double>>& all) {
  std::vector<UnreadBytes::Received> out;
  for (const auto& [id, caller, mib] : all) {
    out.push_back({id, caller, static_cast<std::uint64_t>(mib * static_cast<double>(kMiB))});
  }
  return out;
}

TEST(UnreadBytes, AConnectionEndsBeyondItsLimit) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  EXPECT_EQ(unread.over(received({{1, "ada", 47}, {2, "bob", 49}}), now), Ids{2});
}

TEST(UnreadBytes, UsedMessagesDoNotCount) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  double sent = 0;
  for (int i = 0; i < 100; ++i) {
    unread.taken(1, 10 * kMiB, UnreadBytes::kCallOverhead);
    sent += 10.05;  // with what HTTP/2 and TLS add
    EXPECT_EQ(unread.over(received({{1, "ada", sent}}), now), Ids{});
  }
  // Small messages, with as much around them.
  for (int i = 0; i < 100'000; ++i) {
    unread.taken(2, 50, UnreadBytes::kCallOverhead);
  }
  EXPECT_EQ(unread.over(received({{2, "ada", 100'000 * 300.0 / static_cast<double>(kMiB)}}), now), Ids{});
}

TEST(UnreadBytes, CreditNeverExceedsTheReceivedBytes) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  for (int i = 0; i < 1000; ++i) {
    unread.taken(1, kMiB, 0);
  }
  EXPECT_EQ(unread.over(received({{1, "ada", 10}}), now), Ids{});
  EXPECT_EQ(unread.over(received({{1, "ada", 59}}), now), Ids{1});
}

TEST(UnreadBytes, PingsOfALongConnectionDoNotCount) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  double sent = 0;
  for (int hour = 0; hour < 100'000; ++hour) {
    // A count each 30 s, in which a heartbeat and a ping come.
    for (int i = 0; i < 120; i += 40) {
      unread.taken(1, 20, UnreadBytes::kMessageOverhead);
      sent += 120 / static_cast<double>(kMiB);
      EXPECT_EQ(unread.over(received({{1, "ada", sent}}), now + std::chrono::seconds(hour * 3600 + i * 30)), Ids{});
    }
  }
  EXPECT_GT(sent, 30);
}

TEST(UnreadBytes, EmptyMessagesEarnNearlyNothing) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  for (int i = 0; i < 100'000; ++i) {
    unread.taken(1, 0, UnreadBytes::kMessageOverhead);  // five bytes and a frame each
  }
  EXPECT_EQ(unread.over(received({{1, "ada", 50 + 100'000 * 14.0 / static_cast<double>(kMiB)}}), now), Ids{1});
}

TEST(UnreadBytes, TheLargestConnectionsOfACallerEnd) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 1000 * kMiB});
  EXPECT_EQ(unread.over(received({{1, "ada", 30}, {2, "ada", 40}, {3, "bob", 41}}), now), Ids{2});
}

TEST(UnreadBytes, TheLargestConnectionsOfAllEnd) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 100 * kMiB});
  EXPECT_EQ(unread.over(received({{1, "ada", 40}, {2, "bob", 42}, {3, "eve", 41}}), now), Ids{2});
}

TEST(UnreadBytes, MachinesThatMayShareACallerHaveOnlyTheirOwnLimit) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 100 * kMiB});
  std::vector<UnreadBytes::Received> all = received({{1, "workers", 40}, {2, "workers", 47}, {3, "workers", 49}});
  for (UnreadBytes::Received& each : all) {
    each.alone = true;
  }
  EXPECT_EQ(unread.over(all, now), Ids{3});
}

TEST(UnreadBytes, ASmallConnectionSurvivesItsCallersOverrun) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 1000 * kMiB});
  std::vector<std::tuple<UnreadBytes::Id, std::string, double>> all{{1000, "workers", 30}};
  for (UnreadBytes::Id id = 1; id < 200; ++id) {
    all.emplace_back(id, "workers", 0.2);
  }
  EXPECT_EQ(unread.over(received(all), now), Ids{1000});
}

}  // namespace
}  // namespace lightmill
