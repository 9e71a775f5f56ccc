#include "server/runtime/outgoing_queue.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

JobDescription description_of(std::size_t scene_bytes) {
  JobDescription description;
  description.settings.scene = std::string(scene_bytes, 's');
  description.settings.assets = std::vector<Sha256>(10'000);
  return description;
}

TEST(OutgoingQueueTest, TheLimitIsAFewMoreThanSixteenOfTheLargestScenes) {
  const JobDescription largest = description_of(std::size_t{16} << 20);
  OutgoingQueue queue;
  for (int i = 0; i < 16; ++i) {
    queue.push(largest);
    queue.push(LeaseGrant{LeaseId{1}, {}, {}, std::vector<Sha256>(10'000)});
  }
  EXPECT_FALSE(queue.is_full());
  int more = 0;
  for (; !queue.is_full() && more < 100; ++more) {
    queue.push(largest);
  }
  EXPECT_LE(more, 4);
  queue.pop();
  queue.pop();
  EXPECT_FALSE(queue.is_full());
  queue.clear();
  EXPECT_TRUE(queue.empty());
}

TEST(OutgoingQueueTest, AcknowledgementsAreMergedAndCountTowardsTheLimit) {
  OutgoingQueue queue;
  for (int i = 0; i < 100; ++i) {
    queue.push(ResultAck{std::vector<NodeKey>(100)});
  }
  EXPECT_EQ(std::get<ResultAck>(queue.pop()).keys.size(), 10'000u);
  EXPECT_TRUE(queue.empty());
  const JobDescription largest = description_of(std::size_t{16} << 20);
  for (int i = 0; i < 19; ++i) {
    queue.push(largest);
  }
  EXPECT_FALSE(queue.is_full());
  for (int i = 0; i < 200; ++i) {
    queue.push(ResultAck{std::vector<NodeKey>(5'000)});
  }
  EXPECT_TRUE(queue.is_full()) << "19 times 16 MiB, and 1,000,000 keys of " << sizeof(NodeKey) << " bytes";
  while (!queue.empty()) {
    queue.pop();
  }
  EXPECT_FALSE(queue.is_full());
}

}  // namespace
}  // namespace lightmill
