// Token buckets, compared with counting by hand.
#include "server/access/token_bucket.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

Time bucket_time(double seconds) {
  return Time{from_seconds(seconds)};
}

TEST(TokenBucketTest, ABurstIsFollowedByASteadyRate) {
  TokenBucket bucket(2, 3);
  int taken = 0;
  for (int i = 0; i < 10; ++i) {
    taken += bucket.take(bucket_time(100)) ? 1 : 0;
  }
  EXPECT_EQ(taken, 3);
  EXPECT_EQ(bucket.wait(bucket_time(100)), from_seconds(0.5));
  EXPECT_FALSE(bucket.take(bucket_time(100.4375)));
  EXPECT_TRUE(bucket.take(bucket_time(100.5)));
  EXPECT_FALSE(bucket.take(bucket_time(100.5)));
  // Over 50 seconds with 16 requests a second, two a second pass.
  taken = 0;
  for (int i = 1; i <= 800; ++i) {
    taken += bucket.take(bucket_time(100.5 + i / 16.0)) ? 1 : 0;
  }
  EXPECT_EQ(taken, 100);
}

TEST(TokenBucketTest, RefillsUpToTheBurst) {
  TokenBucket bucket(1, 2);
  EXPECT_TRUE(bucket.is_full(bucket_time(0)));
  EXPECT_TRUE(bucket.take(bucket_time(0)));
  EXPECT_FALSE(bucket.is_full(bucket_time(0.5)));
  EXPECT_TRUE(bucket.is_full(bucket_time(1)));
  EXPECT_TRUE(bucket.take(bucket_time(1000)));
  EXPECT_TRUE(bucket.take(bucket_time(1000)));
  EXPECT_FALSE(bucket.take(bucket_time(1000)));
  EXPECT_EQ(bucket.wait(bucket_time(2000)), Duration::zero());
}

TEST(TokenBucketTest, TimesOutOfOrderGiveNothingTwice) {
  TokenBucket bucket(1, 1);
  EXPECT_TRUE(bucket.take(bucket_time(10)));
  EXPECT_FALSE(bucket.take(bucket_time(5)));
  EXPECT_FALSE(bucket.take(bucket_time(10.5)));
  EXPECT_FALSE(bucket.take(bucket_time(5.5)));
  EXPECT_TRUE(bucket.take(bucket_time(11)));
}

}  // namespace
}  // namespace lightmill
