#include "server/web/change_log.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

using Log = ChangeLog<int>;

/// "key=bytes", or "key-" if it was removed.
std::vector<std::string> texts(const Log::Changes& changes) {
  std::vector<std::string> found;
  for (const auto& [key, entry] : changes.entries) {
    found.push_back(std::to_string(key) + (entry->bytes == nullptr ? "-" : "=" + *entry->bytes));
  }
  return found;
}
using Texts = std::vector<std::string>;

TEST(ChangeLog, AReaderGetsEachChangeOnceWithItsNewestValue) {
  Log log;
  ChangeCursor reader;
  log.put(1, "a");
  log.put(2, "b");
  Log::Changes changes = log.since(reader, 10);
  EXPECT_TRUE(changes.whole);
  EXPECT_EQ(texts(changes), (Texts{"1=a", "2=b"}));
  EXPECT_FALSE(log.has_changes_for(reader));
  log.put(1, "c");
  log.put(2, "b");
  log.put(1, "d");
  changes = log.since(reader, 10);
  EXPECT_FALSE(changes.whole);
  EXPECT_EQ(texts(changes), Texts{"1=d"}) << "equal bytes are no change";
}

TEST(ChangeLog, AnEmptyLogIsSentOnce) {
  const Log log;
  ChangeCursor reader;
  EXPECT_TRUE(log.has_changes_for(reader));
  const Log::Changes changes = log.since(reader, 10);
  EXPECT_TRUE(changes.whole);
  EXPECT_TRUE(changes.entries.empty());
  EXPECT_FALSE(log.has_changes_for(reader));
}

TEST(ChangeLog, ChangesBeyondTheLimitComeNext) {
  Log log;
  ChangeCursor reader;
  for (int i = 1; i <= 5; ++i) {
    log.put(i, "x");
  }
  Log::Changes changes = log.since(reader, 3);
  EXPECT_TRUE(changes.more);
  EXPECT_EQ(texts(changes), (Texts{"1=x", "2=x", "3=x"}));
  log.put(1, "y");
  changes = log.since(reader, 3);
  EXPECT_FALSE(changes.whole);
  EXPECT_FALSE(changes.more);
  EXPECT_EQ(texts(changes), (Texts{"4=x", "5=x", "1=y"}));
}

TEST(ChangeLog, RemovalsAreSentToReadersThatKnewTheKey) {
  Log log;
  ChangeCursor early;
  log.put(1, "a");
  log.put(2, "b");
  log.since(early, 10);
  log.remove(1);
  log.remove(7);
  EXPECT_EQ(texts(log.since(early, 10)), Texts{"1-"});
  ChangeCursor late;
  EXPECT_EQ(texts(log.since(late, 10)), Texts{"2=b"});
  EXPECT_EQ(log.size(), 1u);
  EXPECT_EQ(log.keys(), std::vector<int>{2});
}

TEST(ChangeLog, AReaderThatMissedRemovalsStartsAgainAndFinishes) {
  Log log(2);
  ChangeCursor reader;
  for (int i = 0; i < 8; ++i) {
    log.put(i, "x");
  }
  log.since(reader, 10);
  for (int i = 0; i < 4; ++i) {
    log.remove(i);
  }
  EXPECT_EQ(log.size(), 4u);
  Texts all;
  int messages = 0;
  bool whole = false;
  for (bool more = true; more; ++messages) {
    const Log::Changes changes = log.since(reader, 3);
    whole = whole || changes.whole;
    more = changes.more;
    for (const std::string& text : texts(changes)) {
      all.push_back(text);
    }
    ASSERT_LT(messages, 10);
  }
  EXPECT_TRUE(whole);
  all.resize(4);
  EXPECT_EQ(all, (Texts{"4=x", "5=x", "6=x", "7=x"}));
}

}  // namespace
}  // namespace lightmill
