// The farm's action log: what it keeps, drops and finds.
#include "server/access/action_log.h"

#include <gtest/gtest.h>

#include <set>

#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr std::int64_t kDayMs = 86'400'000;

Action action(const std::string& what, std::uint64_t job = 0, std::int64_t unix_ms = 1'000) {
  Action made;
  made.operation = what;
  made.job = job;
  made.caller = "ada";
  made.proof = Proof::certificate;
  made.peer = "10.0.0.7:4711";
  made.unix_ms = unix_ms;
  return made;
}

Action refusal(std::uint64_t job) {
  Action made = action("CancelJob", job);
  made.outcome = StatusCode::kPermissionDenied;
  return made;
}

Action coming(const std::string& worker, const std::string& peer, std::int64_t unix_ms) {
  Action made = action(std::string(kWorkAction), 0, unix_ms);
  made.about = worker;
  made.peer = peer;
  return made;
}

std::vector<std::uint64_t> numbers(const std::vector<Action>& actions) {
  std::vector<std::uint64_t> all;
  for (const Action& each : actions) {
    all.push_back(each.number);
  }
  return all;
}

using Numbers = std::vector<std::uint64_t>;

TEST(ActionLogTest, NumbersIncreaseAcrossARestart) {
  ActionLog log({}, {});
  const Action first = *log.add(action("SubmitJob", 1)).added, second = *log.add(action("CancelJob", 1)).added;
  EXPECT_EQ(first.number, 1u);
  EXPECT_EQ(second.number, 2u);
  ActionLog again({}, {second, first});
  EXPECT_EQ(again.add(action("DeleteJob", 1)).added->number, 3u);
  EXPECT_EQ(numbers(again.find({}, 10).actions), (Numbers{3, 2, 1})) << "newest first";
}

TEST(ActionLogTest, IsFoundByJobNameTimeAndPage) {
  ActionLog log({}, {});
  for (std::uint64_t i = 1; i <= 6; ++i) {
    Action each = action("CancelJob", i % 2, static_cast<std::int64_t>(i));
    each.caller = i <= 3 ? "ada" : "bob";
    log.add(each);
  }
  EXPECT_EQ(numbers(log.find({1, "", 0, 0}, 10).actions), (Numbers{5, 3, 1}));
  EXPECT_EQ(numbers(log.find({0, "ada", 0, 0}, 10).actions), (Numbers{3, 2, 1}));
  EXPECT_EQ(numbers(log.find({0, "", 4, 0}, 10).actions), (Numbers{6, 5, 4}));
  EXPECT_EQ(numbers(log.find({1, "bob", 0, 0}, 10).actions), (Numbers{5}));
  EXPECT_EQ(numbers(log.find({}, 4).actions), (Numbers{6, 5, 4, 3}));
  EXPECT_EQ(numbers(log.find({0, "", 0, 3}, 4).actions), (Numbers{2, 1}));
}

TEST(ActionLogTest, OnePageScansABoundedPart) {
  ActionLog log({}, {});
  log.add(action("SubmitJob", 7));
  for (std::size_t i = 0; i < 2 * ActionLog::kMaxScanned; ++i) {
    log.add(action("CancelJob", 1));
  }
  log.add(action("SubmitJob", 7));
  ActionFilter filter{7, "", 0, 0};
  Numbers all;
  std::size_t pages = 0;
  do {
    const ActionPage page = log.find(filter, 10);
    const Numbers some = numbers(page.actions);
    all.insert(all.end(), some.begin(), some.end());
    filter.before = page.next;
    ++pages;
  } while (filter.before > 0);
  EXPECT_EQ(pages, 3u);
  EXPECT_EQ(all, (Numbers{2 * ActionLog::kMaxScanned + 2, 1}));
  EXPECT_EQ(log.find({7, "", 0, 0}, 1).next, 2 * ActionLog::kMaxScanned + 2) << "there may be more";
}

TEST(ActionLogTest, RefusalsAndWorkersDoNotDisplaceActions) {
  ActionLog log({8, 400}, {});
  std::set<std::uint64_t> stored;
  const auto add = [&](const Action& each) {
    const ActionLog::Change change = log.add(each);
    if (change.added) {
      stored.insert(change.added->number);
    }
    for (const std::uint64_t number : change.dropped) {
      EXPECT_EQ(stored.erase(number), 1u);
    }
  };
  add(action("SubmitJob", 1));
  for (std::uint64_t i = 0; i < 100; ++i) {
    add(refusal(i));
    add(coming(fmt::format("w{}", i), "h:1", 1'000));
  }
  EXPECT_EQ(log.find({}, 100).actions.size(), 5u) << "one, and two of a quarter of eight each";
  EXPECT_EQ(log.find({}, 100).actions.back().operation, "SubmitJob");
  for (std::uint64_t i = 0; i < 8; ++i) {
    add(action("PauseJob", i));
  }
  EXPECT_EQ(log.find({}, 100).actions.size(), 12u);
  const std::vector<std::uint64_t> kept = numbers(log.find({}, 100).actions);
  EXPECT_EQ(std::set<std::uint64_t>(kept.begin(), kept.end()), stored) << "the store holds the same";
}

TEST(ActionLogTest, OldEntriesAreDropped) {
  ActionLog log({100, 10}, {});
  log.add(action("SubmitJob", 1, 1));
  log.add(refusal(1));
  log.add(action("PauseJob", 1, 5 * kDayMs));
  EXPECT_EQ(numbers(log.find({}, 100).actions), (Numbers{3, 2, 1}));
  EXPECT_EQ(log.add(action("CancelJob", 1, 10 * kDayMs + 2)).dropped, (Numbers{1}));
  EXPECT_EQ(log.add(action("DeleteJob", 1, 12 * kDayMs)).dropped, (Numbers{2}));
  EXPECT_EQ(numbers(log.find({}, 100).actions), (Numbers{5, 4, 3}));
}

TEST(ActionLogTest, AReconnectingWorkerIsRecordedOnce) {
  constexpr std::int64_t kHourMs = 3'600'000;
  ActionLog log({}, {});
  EXPECT_TRUE(log.add(coming("w1", "10.0.0.7:1", 0)).added);
  EXPECT_FALSE(log.add(coming("w1", "10.0.0.7:2", 1)).added) << "another port of the same host";
  EXPECT_TRUE(log.add(coming("w1", "10.0.0.8:1", 2)).added);
  EXPECT_TRUE(log.add(coming("w2", "10.0.0.8:1", 3)).added);
  Action other = coming("w1", "10.0.0.8:1", 4);
  other.caller = "eve";
  EXPECT_TRUE(log.add(other).added) << "by another identity";
  EXPECT_FALSE(log.add(other).added);
  other.unix_ms += kHourMs;
  EXPECT_TRUE(log.add(other).added);
  ActionLog again({}, log.find({}, 100).actions);
  EXPECT_FALSE(again.add(other).added) << "also after a start";
}

TEST(ActionLogTest, AStoppedCoordinatorDiffersFromAKilledOne) {
  ActionLog log({}, {});
  EXPECT_FALSE(log.coordinator_is_active());
  log.add(action(std::string(kStart)));
  log.add(action("SubmitJob", 1));
  EXPECT_TRUE(ActionLog({}, log.find({}, 100).actions).coordinator_is_active());
  log.add(action(std::string(kStop)));
  EXPECT_FALSE(ActionLog({}, log.find({}, 100).actions).coordinator_is_active());
}

TEST(ActionLogTest, ForeignTextsAreCutAndMadePrintable) {
  ActionLog log({}, {});
  Action rude = refusal(1);
  rude.about = "w\x1b[31m" + std::string(10'000, 'x');
  rude.message = fmt::format("{}ääää\n", std::string(399, 'y'));
  rude.change = rude.message;
  const Action kept = *log.add(rude).added;
  EXPECT_EQ(kept.change, kept.message);
  EXPECT_TRUE(check_name("about", kept.about).ok());
  EXPECT_EQ(kept.message, std::string(399, 'y') + "…");
}

TEST(ActionLogTest, AddressesHaveTheirUsualForm) {
  EXPECT_EQ(peer_text("ipv4:10.0.0.7:4711"), "10.0.0.7:4711");
  EXPECT_EQ(peer_text("ipv6:%5B::1%5D:4711"), "[::1]:4711");
  EXPECT_EQ(peer_text("unix:/run/x"), "unix:/run/x");
}

}  // namespace
}  // namespace lightmill
