#include "server/listen/unread_bytes.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr std::uint64_t kMiB = 1 << 20;
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
  EXPECT_EQ(unread.over(received({{1, "ada", 47}, {2, "bob", 49}})), Ids{2});
}

TEST(UnreadBytes, UsedMessagesDoNotCount) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  double sent = 0;
  for (int i = 0; i < 100; ++i) {
    unread.taken(1, 10 * kMiB);
    sent += 10.1;  // with what HTTP/2 and TLS add
    EXPECT_EQ(unread.over(received({{1, "ada", sent}})), Ids{});
  }
  // Small messages, with as much around them.
  for (int i = 0; i < 100'000; ++i) {
    unread.taken(2, 50);
  }
  EXPECT_EQ(unread.over(received({{2, "ada", 100'000 * 300.0 / static_cast<double>(kMiB)}})), Ids{});
}

TEST(UnreadBytes, WhatWasNotSentGivesNoCredit) {
  UnreadBytes unread({48 * kMiB, 1000 * kMiB, 1000 * kMiB});
  for (int i = 0; i < 1000; ++i) {
    unread.taken(1, kMiB);
  }
  EXPECT_EQ(unread.over(received({{1, "ada", 10}})), Ids{});
  EXPECT_EQ(unread.over(received({{1, "ada", 59}})), Ids{1});
}

TEST(UnreadBytes, TheLargestConnectionsOfACallerEnd) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 1000 * kMiB});
  EXPECT_EQ(unread.over(received({{1, "ada", 30}, {2, "ada", 40}, {3, "bob", 41}})), Ids{2});
}

TEST(UnreadBytes, TheLargestConnectionsOfAllEnd) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 100 * kMiB});
  EXPECT_EQ(unread.over(received({{1, "ada", 40}, {2, "bob", 42}, {3, "eve", 41}})), Ids{2});
}

TEST(UnreadBytes, WorkersThatShareAnIdentityAreNotEndedForOneOfThem) {
  UnreadBytes unread({48 * kMiB, 64 * kMiB, 1000 * kMiB});
  std::vector<std::tuple<UnreadBytes::Id, std::string, double>> all{{1000, "workers", 30}};
  for (UnreadBytes::Id id = 1; id < 200; ++id) {
    all.emplace_back(id, "workers", 0.2);
  }
  EXPECT_EQ(unread.over(received(all)), Ids{1000});
}

}  // namespace
}  // namespace lightmill
