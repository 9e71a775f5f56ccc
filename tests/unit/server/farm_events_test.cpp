// Events of the farm: selection, and what a caller may see.
#include "server/domain/farm_events.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

using Numbers = std::vector<std::uint64_t>;

Numbers numbers(const FarmEvents::Page& page) {
  Numbers all;
  for (const RecordedEvent& event : page.events) {
    all.push_back(event.number);
  }
  return all;
}

class FarmEventsTest : public ::testing::Test {
 protected:
  FarmEventsTest() {
    events_.add(1000, {Note::Level::info, "worker a connected", {}, "a"}, "");
    events_.add(2000, {Note::Level::info, "job 1 starts on worker a", JobId{1}, "a"}, "ada");
    events_.add(3000, {Note::Level::warning, "job 1 is failed", JobId{1}}, "ada");
    events_.add(4000, {Note::Level::info, "job 2 is done", JobId{2}}, "bob");
    events_.add(5000, {Note::Level::warning, "leasing is stopped"}, "");
  }
  FarmEvents events_;
};

TEST_F(FarmEventsTest, EventsAreFoundByJobWorkerAndKind) {
  EXPECT_EQ(numbers(events_.find({}, 10)), (Numbers{5, 4, 3, 2, 1}));
  EXPECT_EQ(events_.find({}, 10).events[4].unix_ms, 1000);
  FarmEvents::Filter filter;
  filter.job = JobId{1};
  EXPECT_EQ(numbers(events_.find(filter, 10)), (Numbers{3, 2}));
  filter.kind = FarmEvents::Kind::warnings;
  EXPECT_EQ(numbers(events_.find(filter, 10)), (Numbers{3}));
  filter = {};
  filter.worker = std::string("a");
  EXPECT_EQ(numbers(events_.find(filter, 10)), (Numbers{2, 1}));
  filter = {};
  filter.kind = FarmEvents::Kind::jobs;
  EXPECT_EQ(numbers(events_.find(filter, 10)), (Numbers{4, 3, 2}));
  filter.kind = FarmEvents::Kind::workers;
  EXPECT_EQ(numbers(events_.find(filter, 10)), (Numbers{2, 1}));
}

TEST_F(FarmEventsTest, EventsOfOthersJobsAreHidden) {
  FarmEvents::Filter filter;
  filter.admits = [](const std::string& owner) { return owner == "bob"; };
  EXPECT_EQ(numbers(events_.find(filter, 10)), (Numbers{5, 4, 1}));
}

TEST_F(FarmEventsTest, EventsAreReadInPages) {
  FarmEvents::Filter filter;
  Numbers all;
  do {
    const FarmEvents::Page page = events_.find(filter, 2);
    const Numbers some = numbers(page);
    EXPECT_LE(some.size(), 2u);
    all.insert(all.end(), some.begin(), some.end());
    filter.before = page.next;
  } while (filter.before > 0);
  EXPECT_EQ(all, (Numbers{5, 4, 3, 2, 1}));
}

TEST_F(FarmEventsTest, OldEventsAreDroppedAndTextsAreCut) {
  for (std::size_t i = 0; i < FarmEvents::kMax; ++i) {
    events_.add(6000, {Note::Level::info, fmt::format("{}\x1b", std::string(5'000, 'x')), {}, {}}, "");
  }
  const FarmEvents::Page page = events_.find({}, FarmEvents::kMax);
  EXPECT_EQ(page.events.size(), FarmEvents::kMax);
  EXPECT_EQ(page.events.back().number, 6u);
  EXPECT_EQ(page.events.back().note.text, fmt::format("{}…", std::string(FarmEvents::kMaxTextBytes, 'x')));
}

}  // namespace
}  // namespace lightmill
