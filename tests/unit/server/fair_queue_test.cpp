#include "server/scheduling/fair_queue.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

std::vector<std::uint64_t> order(const FairQueue& queue) {
  std::vector<std::uint64_t> ids;
  for (const FairQueue::Entry& entry : queue) {
    ids.push_back(entry.job.value);
  }
  return ids;
}

TEST(FairQueue, OrdersByPriorityThenFirstPictureThenFewestSeconds) {
  FairQueue queue;
  queue.put(JobId{1}, {0, false, 5});
  queue.put(JobId{2}, {0, false, 3});
  queue.put(JobId{3}, {0, true, 9});
  queue.put(JobId{4}, {1, false, 100});
  queue.put(JobId{5}, {-2, true, 0});
  EXPECT_EQ(order(queue), (std::vector<std::uint64_t>{4, 3, 2, 1, 5}));
  queue.put(JobId{2}, {0, false, 6});
  queue.remove(JobId{4});
  EXPECT_EQ(order(queue), (std::vector<std::uint64_t>{3, 1, 2, 5}));
}

TEST(FairQueue, ANewJobStartsWithTheLeastShareOfItsPriority) {
  FairQueue queue;
  EXPECT_EQ(queue.starting_seconds(0), 0);
  queue.put(JobId{1}, {0, false, 5});
  queue.put(JobId{2}, {0, false, 8});
  queue.put(JobId{3}, {0, true, 7});
  queue.put(JobId{4}, {1, false, 1});
  EXPECT_EQ(queue.starting_seconds(0), 5);
  EXPECT_EQ(queue.starting_seconds(1), 1);
  EXPECT_EQ(queue.starting_seconds(2), 0);
}

}  // namespace
}  // namespace lightmill
