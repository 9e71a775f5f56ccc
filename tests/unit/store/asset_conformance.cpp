#include "tests/unit/store/asset_conformance.h"

#include <atomic>
#include <limits>
#include <thread>

namespace lightmill::test {
namespace {

/// Longer than a test lasts.
constexpr std::chrono::seconds kSpareAge = std::chrono::hours(1);

Status put(AssetStore& store, std::string_view bytes, const Sha256& digest, std::size_t piece_bytes = 3,
           const std::string& user = "") {
  LM_ASSIGN_OR_RETURN(const auto upload, store.start_upload(digest, user));
  for (std::size_t at = 0; at < bytes.size(); at += piece_bytes) {
    LM_RETURN_IF_ERROR(upload->append(as_byte_view(bytes.substr(at, piece_bytes))));
  }
  return upload->finish();
}

Result<std::string> get(const AssetStore& store, const Sha256& digest, std::size_t piece_bytes = 4) {
  LM_ASSIGN_OR_RETURN(const auto reader, store.open_asset(digest));
  std::string all;
  for (;;) {
    LM_ASSIGN_OR_RETURN(const std::string piece, reader->next(piece_bytes));
    if (piece.empty()) {
      return all;
    }
    all += piece;
  }
}

}  // namespace

TEST_P(AssetConformance, ReturnsStoredBytes) {
  const std::string bytes = "some bytes of a mesh";
  auto store = open();
  EXPECT_FALSE(store->has(sha256(bytes)));
  EXPECT_EQ(get(*store, sha256(bytes)).status().code(), StatusCode::kNotFound);
  ASSERT_TRUE(put(*store, bytes, sha256(bytes)).ok());
  EXPECT_EQ(get(*store, sha256(bytes)).value(), bytes);
  store.reset();
  EXPECT_EQ(get(*open(), sha256(bytes)).value(), bytes) << "after a restart";
}

TEST_P(AssetConformance, AnySizeWithinTheLimitsIsStored) {
  const auto store = open();
  std::string bytes;
  for (std::uint32_t i = 0; bytes.size() < 2'500'000; ++i) {
    bytes += static_cast<char>(i * 2654435761u >> 24);
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1} << 20, bytes.size()}) {
    const std::string asset = bytes.substr(0, size);
    ASSERT_TRUE(put(*store, asset, sha256(asset), 77'777).ok()) << size;
    EXPECT_EQ(store->size(sha256(asset)).value(), size);
    EXPECT_TRUE(get(*store, sha256(asset), 99'999).value() == asset) << size;
  }
}

TEST_P(AssetConformance, WrongBytesLeaveNothing) {
  const auto store = open();
  const Status status = put(*store, "these", sha256("those"));
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_FALSE(store->has(sha256("those")));
  EXPECT_FALSE(store->has(sha256("these")));
  EXPECT_EQ(store->total_bytes(), 0u);
}

TEST_P(AssetConformance, AnUploadThatEndsEarlyLeavesNothing) {
  {
    const auto store = open();
    const auto upload = store->start_upload(sha256("whole")).value();
    ASSERT_TRUE(upload->append(as_byte_view("wh")).ok());
    EXPECT_EQ(store->total_bytes(), 2u);
  }
  place_->leave_half_an_upload();
  EXPECT_TRUE(place_->has_halves());
  const auto store = open();
  EXPECT_FALSE(place_->has_halves());
  EXPECT_EQ(store->total_bytes(), 0u);
}

TEST_P(AssetConformance, LimitsHold) {
  auto store = open({.asset_bytes = 10, .total_bytes = 15});
  EXPECT_EQ(put(*store, "eleven bytes", sha256("eleven bytes")).code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(put(*store, "ten bytes!", sha256("ten bytes!")).ok());
  EXPECT_EQ(put(*store, "six bi", sha256("six bi")).code(), StatusCode::kResourceExhausted);
  const auto room = [&store](std::uint64_t bytes) { return store->check_room(sha256("next"), "", bytes).code(); };
  EXPECT_EQ(room(5), StatusCode::kOk);
  EXPECT_EQ(room(6), StatusCode::kResourceExhausted) << "with those that are there";
  EXPECT_EQ(room(std::numeric_limits<std::uint64_t>::max()), StatusCode::kResourceExhausted);
  EXPECT_TRUE(put(*store, "five!", sha256("five!")).ok());
  EXPECT_EQ(store->total_bytes(), 15u);
  store.reset();
  EXPECT_EQ(open()->total_bytes(), 15u) << "counted again after a restart";
}

TEST_P(AssetConformance, AUserCannotTakeTheRoomOfOthers) {
  const AssetLimits limits{.user_bytes = 10'000};
  const std::string worker(kUploadsOfWorkers);
  auto store = open(limits);
  const auto file = [](char name, std::size_t bytes) { return std::string(bytes, name); };
  const auto send = [&](const std::string& user, const std::string& bytes) {
    return put(*store, bytes, sha256(bytes), 1000, user).code();
  };
  EXPECT_EQ(send("ada", file('a', 3'000)), StatusCode::kOk);
  EXPECT_EQ(send("ada", file('b', 3'000)), StatusCode::kResourceExhausted) << "each file counts 4 KiB more";
  EXPECT_EQ(send("ada", file('c', 2'000)), StatusCode::kOk) << "a refused upload does not count";
  EXPECT_EQ(send("ada", "1"), StatusCode::kResourceExhausted);
  EXPECT_EQ(send("bob", file('c', 2'000)), StatusCode::kOk) << "there already, so it stays ada's";
  EXPECT_EQ(send("bob", file('d', 9'000)), StatusCode::kOk);
  EXPECT_EQ(send("", file('e', 20'000)), StatusCode::kOk) << "no user's";
  EXPECT_EQ(send(worker, file('f', 5'001)), StatusCode::kResourceExhausted);
  EXPECT_EQ(send(worker, file('f', 5'000)), StatusCode::kOk);
  store->forget(*store->open_asset(sha256(file('a', 3'000))).value());
  EXPECT_EQ(store->collect({sha256(file('d', 9'000))}, -1), 2'000u + 20'000 + 5'000);
  EXPECT_EQ(send("ada", file('g', 10'000)), StatusCode::kOk) << "its room is back";
  EXPECT_EQ(store->total_bytes(), 19'000u);
  store.reset();
  store = open(limits);
  EXPECT_EQ(send("ada", file('h', 1'000)), StatusCode::kOk) << "the store does not know whose they are";
  EXPECT_TRUE(store->attribute(sha256(file('g', 10'000)), "bob", UserLimit::ignored).ok());
  EXPECT_TRUE(store->attribute(sha256(file('g', 10'000)), "ada", UserLimit::ignored).ok());
  EXPECT_EQ(send("bob", "1"), StatusCode::kResourceExhausted);
  EXPECT_EQ(send("ada", file('i', 1'000)), StatusCode::kOk);
}

TEST_P(AssetConformance, AnAssetOfAWorkerBecomesItsUsers) {
  const auto store = open({.user_bytes = 20'000});
  const std::string worker(kUploadsOfWorkers), texture(5'000, 't'), other(4'000, 'o');
  const auto send = [&](const std::string& user, const std::string& bytes) {
    return put(*store, bytes, sha256(bytes), 1000, user).code();
  };
  const auto take = [&](const std::string& user, const std::string& bytes) {
    return store->attribute(sha256(bytes), user, UserLimit::enforced).code();
  };
  EXPECT_EQ(take("ada", texture), StatusCode::kNotFound);
  ASSERT_EQ(send(worker, texture), StatusCode::kOk);
  EXPECT_EQ(store->check_room(sha256(other), worker, 4'000).code(), StatusCode::kResourceExhausted);
  ASSERT_EQ(send(worker, other), StatusCode::kResourceExhausted);
  EXPECT_EQ(take("ada", texture), StatusCode::kOk);
  EXPECT_EQ(store->check_room(sha256(other), worker, 4'000).code(), StatusCode::kOk);
  ASSERT_EQ(send(worker, other), StatusCode::kOk) << "the workers have their room again";
  EXPECT_EQ(take("bob", texture), StatusCode::kOk) << "it stays ada's";
  EXPECT_EQ(store->check_room(sha256("a"), "bob", 20'000).code(), StatusCode::kOk);
  EXPECT_EQ(store->check_room(sha256("a"), "ada", 20'000 - (5'000 + 4'096)).code(), StatusCode::kOk);
  EXPECT_EQ(store->check_room(sha256("a"), "ada", 20'001 - (5'000 + 4'096)).code(), StatusCode::kResourceExhausted);
  ASSERT_EQ(send("ada", std::string(3'000, 'a')), StatusCode::kOk);
  EXPECT_EQ(take("ada", other), StatusCode::kResourceExhausted);
  EXPECT_EQ(store->check_room(sha256("a"), worker, 1'905).code(), StatusCode::kResourceExhausted) << "it stays theirs";
  store->forget(*store->open_asset(sha256(texture)).value());
  EXPECT_EQ(take("ada", other), StatusCode::kOk);
  EXPECT_EQ(store->check_room(sha256("a"), worker, 10'000).code(), StatusCode::kOk);
}

TEST_P(AssetConformance, AForgottenAssetCanBeStoredAgain) {
  const auto store = open();
  ASSERT_TRUE(put(*store, "one", sha256("one")).ok() && put(*store, "two!", sha256("two!")).ok());
  ASSERT_TRUE(store->keep(sha256("one")));
  const auto first = store->open_asset(sha256("one")).value(), second = store->open_asset(sha256("one")).value();
  store->forget(*first);
  EXPECT_FALSE(store->has(sha256("one")));
  EXPECT_EQ(store->total_bytes(), 4u);
  ASSERT_TRUE(put(*store, "one", sha256("one")).ok());
  store->forget(*second);
  EXPECT_EQ(get(*store, sha256("one")).value(), "one") << "the one that came since is another one";
  EXPECT_EQ(store->total_bytes(), 7u);
}

TEST_P(AssetConformance, ManyCanPutTheSameAssetAtOnce) {
  const auto store = open();
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

TEST_P(AssetConformance, AssetsThatAreKeptOrSentSurviveACollection) {
  const auto store = open();
  constexpr int kAssets = 60;
  const auto bytes_of = [](int i) { return fmt::format("asset {}", i); };
  const auto digest_of = [&](int i) { return sha256(bytes_of(i)); };
  for (int i = 0; i < kAssets; ++i) {
    ASSERT_TRUE(put(*store, bytes_of(i), digest_of(i)).ok());
  }
  place_->age(2 * kSpareAge);  // all are old enough to go
  std::atomic<int> lost = 0;
  {
    std::vector<std::jthread> threads;
    threads.emplace_back([&] {  // asks for the first third, perhaps too late
      for (int i = 0; i < kAssets / 3; ++i) {
        if (store->keep(digest_of(i))) {
          lost += get(*store, digest_of(i)).ok() ? 0 : 1;
        }
      }
    });
    threads.emplace_back([&] {  // sends the second third again
      for (int i = kAssets / 3; i < 2 * kAssets / 3; ++i) {
        lost += put(*store, bytes_of(i), digest_of(i)).ok() && store->keep(digest_of(i)) ? 0 : 1;
      }
    });
    threads.emplace_back([&] {
      for (int i = 0; i < 3; ++i) {
        store->collect({}, kSpareAge.count());
      }
    });
  }
  EXPECT_EQ(lost, 0);
  std::uint64_t bytes = 0;
  for (const Sha256& digest : store->digests()) {
    bytes += store->size(digest).value();
  }
  EXPECT_EQ(store->total_bytes(), bytes);
  for (int i = 2 * kAssets / 3; i < kAssets; ++i) {
    EXPECT_FALSE(store->has(digest_of(i))) << i;
  }
}

TEST_P(AssetConformance, CollectForgetsUnwantedAssets) {
  const auto store = open();
  ASSERT_TRUE(put(*store, "wanted", sha256("wanted")).ok());
  ASSERT_TRUE(put(*store, "not wanted", sha256("not wanted")).ok());
  EXPECT_EQ(store->collect({sha256("wanted")}, 3600), 0u) << "both are fresh";
  EXPECT_EQ(store->collect({sha256("wanted")}, -1), 10u);
  EXPECT_TRUE(store->has(sha256("wanted")));
  EXPECT_FALSE(store->has(sha256("not wanted")));
  EXPECT_EQ(store->total_bytes(), 6u);
}

TEST_P(AssetConformance, CollectSparesRequestedAssets) {
  const auto store = open();
  ASSERT_TRUE(put(*store, "asked for", sha256("asked for")).ok());
  ASSERT_TRUE(put(*store, "not", sha256("not")).ok());
  place_->age(2 * kSpareAge);
  EXPECT_TRUE(store->keep(sha256("asked for")));
  EXPECT_FALSE(store->keep(sha256("never there")));
  EXPECT_EQ(store->collect({}, kSpareAge.count()), 3u);
  EXPECT_TRUE(store->has(sha256("asked for")));
  EXPECT_EQ(store->collect({}, -1), 9u) << "however fresh";
}

}  // namespace lightmill::test
