#include "server/store/coalesce.h"

#include <gtest/gtest.h>

#include "tests/unit/store/stored_examples.h"

namespace lightmill {
namespace {

TEST(Coalesce, ANodePutAndDroppedIsNotWritten) {
  const NodeKey key{JobId{1}, TileId{2}, {0, 3}};
  const auto ops = coalesce({PutNode{key.job, key.tile, test::small_node(0, 3, 1)}, DropNode{key}});
  ASSERT_EQ(ops.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<DropNode>(ops[0]));
}

TEST(Coalesce, OnlyTheLastRowOfAJobIsWrittenAndItComesFirst) {
  JobRecord last = test::full_record(1);
  last.counters.results_merged = 42;
  const auto ops =
      coalesce({PutJob{test::full_record(1)}, PutNode{JobId{1}, TileId{0}, test::small_node(0, 0, 1)}, PutJob{last}});
  ASSERT_EQ(ops.size(), 2u);
  EXPECT_EQ(std::get<PutJob>(ops[0]).record.counters.results_merged, 42u);
  EXPECT_TRUE(std::holds_alternative<PutNode>(ops[1]));
}

}  // namespace
}  // namespace lightmill
