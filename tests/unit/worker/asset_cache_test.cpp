#include "worker/assets/asset_cache.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

class AssetCacheTest : public ::testing::Test {
 protected:
  AssetCache cache(std::uint64_t limit_bytes) {
    return AssetCache(
        [this](const Sha256& digest) -> Result<std::string> {
          ++fetched_;
          const auto at = farm_.find(digest);
          if (at == farm_.end()) {
            return not_found("there is no asset {}", digest.hex());
          }
          return at->second;
        },
        limit_bytes);
  }
  Sha256 add(const std::string& bytes) {
    farm_[sha256(bytes)] = bytes;
    return sha256(bytes);
  }

  std::map<Sha256, std::string> farm_;
  int fetched_ = 0;
};

TEST_F(AssetCacheTest, FetchesAnAssetOnce) {
  AssetCache assets = cache(100);
  const Sha256 digest = add("mesh");
  EXPECT_EQ(assets.get(digest).value(), "mesh");
  EXPECT_EQ(assets.get(digest).value(), "mesh");
  EXPECT_EQ(fetched_, 1);
}

TEST_F(AssetCacheTest, BytesOfAnotherDigestAreRefused) {
  AssetCache assets = cache(100);
  const Sha256 digest = sha256("mesh");
  farm_[digest] = "something else";
  EXPECT_EQ(assets.get(digest).status().code(), StatusCode::kUnavailable);
  farm_[digest] = "mesh";
  EXPECT_EQ(assets.get(digest).value(), "mesh") << "the damaged bytes were not kept";
}

TEST_F(AssetCacheTest, TheLeastRecentlyUsedAssetIsDroppedFirst) {
  AssetCache assets = cache(10);
  const Sha256 a = add("aaaa"), b = add("bbbb"), c = add("cccc");
  for (const Sha256& digest : {a, b, a, c}) {
    EXPECT_TRUE(assets.get(digest).ok());
  }
  fetched_ = 0;
  EXPECT_TRUE(assets.get(a).ok());
  EXPECT_TRUE(assets.get(c).ok());
  EXPECT_EQ(fetched_, 0);
  EXPECT_TRUE(assets.get(b).ok());
  EXPECT_EQ(fetched_, 1);
}

TEST_F(AssetCacheTest, AnAssetBeyondTheLimitIsReturnedButNotKept) {
  AssetCache assets = cache(3);
  const Sha256 digest = add("mesh");
  EXPECT_EQ(assets.get(digest).value(), "mesh");
  EXPECT_EQ(assets.get(digest).value(), "mesh");
  EXPECT_EQ(fetched_, 2);
}

}  // namespace
}  // namespace lightmill
