#include "server/store/asset_store.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using test::TemporaryFolder;

std::unique_ptr<AssetStore> open_store(const TemporaryFolder& folder, AssetLimits limits = {}) {
  return AssetStore::open(folder.path() / "assets", limits).value();
}

Status put(AssetStore& store, std::string_view bytes, const Sha256& digest) {
  LM_ASSIGN_OR_RETURN(const auto upload, store.start_upload(digest));
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    LM_RETURN_IF_ERROR(upload->append(as_byte_view(bytes.substr(at, 3))));
  }
  return upload->finish();
}

Result<std::string> get(const AssetStore& store, const Sha256& digest) {
  LM_ASSIGN_OR_RETURN(const auto reader, store.open_asset(digest));
  std::string all;
  for (;;) {
    LM_ASSIGN_OR_RETURN(const std::string piece, reader->next(4));
    if (piece.empty()) {
      return all;
    }
    all += piece;
  }
}

TEST(AssetStore, GivesBackWhatWasPut) {
  const TemporaryFolder folder;
  const std::string bytes = "some bytes of a mesh";
  const auto store = open_store(folder);
  EXPECT_FALSE(store->has(sha256(bytes)));
  EXPECT_EQ(get(*store, sha256(bytes)).status().code(), StatusCode::kNotFound);
  ASSERT_TRUE(put(*store, bytes, sha256(bytes)).ok());
  EXPECT_EQ(get(*store, sha256(bytes)).value(), bytes);
  EXPECT_EQ(get(*open_store(folder), sha256(bytes)).value(), bytes) << "after a restart";
}

TEST(AssetStore, WrongBytesLeaveNothing) {
  const TemporaryFolder folder;
  const auto store = open_store(folder);
  const Status status = put(*store, "these", sha256("those"));
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_FALSE(store->has(sha256("those")));
  EXPECT_FALSE(store->has(sha256("these")));
  EXPECT_EQ(store->total_bytes(), 0u);
}

TEST(AssetStore, AnUploadThatEndsEarlyLeavesNothing) {
  const TemporaryFolder folder;
  {
    const auto store = open_store(folder);
    const auto upload = store->start_upload(sha256("whole")).value();
    ASSERT_TRUE(upload->append(as_byte_view("wh")).ok());
    EXPECT_EQ(store->total_bytes(), 2u);
  }
  // As a crash leaves it:
  std::ofstream(folder.path() / "assets" / "incoming" / "left-over") << "rubbish";
  const auto store = open_store(folder);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "assets" / "incoming" / "left-over"));
  EXPECT_EQ(store->total_bytes(), 0u);
}

TEST(AssetStore, LimitsHold) {
  const TemporaryFolder folder;
  const auto store = open_store(folder, {.asset_bytes = 10, .total_bytes = 15});
  EXPECT_EQ(put(*store, "eleven bytes", sha256("eleven bytes")).code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(put(*store, "ten bytes!", sha256("ten bytes!")).ok());
  EXPECT_EQ(put(*store, "six bi", sha256("six bi")).code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(put(*store, "five!", sha256("five!")).ok());
  EXPECT_EQ(store->total_bytes(), 15u);
  EXPECT_EQ(open_store(folder)->total_bytes(), 15u) << "counted anew after a restart";
}

TEST(AssetStore, ManyCanPutTheSameAssetAtOnce) {
  const TemporaryFolder folder;
  const auto store = open_store(folder);
  const std::string bytes(10'000, 'x');
  std::atomic<int> stored = 0;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] { stored += put(*store, bytes, sha256(bytes)).ok() ? 1 : 0; });
    }
  }
  EXPECT_EQ(stored, 4);
  EXPECT_EQ(get(*store, sha256(bytes)).value(), bytes);
}

TEST(AssetStore, CollectForgetsWhatNobodyWants) {
  const TemporaryFolder folder;
  const auto store = open_store(folder);
  ASSERT_TRUE(put(*store, "wanted", sha256("wanted")).ok());
  ASSERT_TRUE(put(*store, "not wanted", sha256("not wanted")).ok());
  EXPECT_EQ(store->collect({sha256("wanted")}, 3600), 0u) << "both are fresh";
  EXPECT_EQ(store->collect({sha256("wanted")}, -1), 10u);
  EXPECT_TRUE(store->has(sha256("wanted")));
  EXPECT_FALSE(store->has(sha256("not wanted")));
  EXPECT_EQ(store->total_bytes(), 6u);
}

}  // namespace
}  // namespace lightmill
