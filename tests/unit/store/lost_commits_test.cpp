// A store after a crash that lost acknowledged commits, or damaged the journal.
#include <gtest/gtest.h>

#include <fstream>

#include "common/base/sanitizers.h"
#include "server/store/sqlite/journal_scan.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/stored_examples.h"

namespace lightmill::test {
namespace {

/// A folder after kill -9: three jobs, each in a commit of its own, and a journal.
class LostCommits : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto store = open();
    ASSERT_TRUE(store->load().ok());
    for (std::uint64_t id = 1; id <= 3; ++id) {
      ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(id)}}).ok());
    }
    for (const auto& file : {file_, journal_, chain_}) {
      std::filesystem::copy_file(file, killed_.path() / file.filename());
    }
  }
  /// Puts back the folder as kill -9 left it.
  void restore() const {
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      std::filesystem::remove(entry);
    }
    for (const auto& entry : std::filesystem::directory_iterator(killed_.path())) {
      std::filesystem::copy_file(entry, folder_.path() / entry.path().filename());
    }
  }
  void flip(const std::filesystem::path& path, std::uintmax_t at) const {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(at));
    const int byte = file.get() ^ 0x10;
    file.seekp(static_cast<std::streamoff>(at));
    file.put(static_cast<char>(byte));
  }
  std::string bytes_of(const std::filesystem::path& path) const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::unique_ptr<Store> open() const {
    Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    EXPECT_TRUE(store.ok()) << store.status();
    return std::move(store).value();
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "store.sqlite";
  const std::filesystem::path chain_ = file_.string() + "-chain";
  const std::filesystem::path journal_ = file_.string() + "-wal";
  const TemporaryFolder killed_;
};

TEST_F(LostCommits, AKilledStoreHasAllCommits) {
  restore();
  const sqlite::JournalScan scan = sqlite::scan_journal(journal_);
  EXPECT_FALSE(scan.damaged);
  EXPECT_GT(scan.frames, 3u);
  EXPECT_EQ(scan.sound_frames, scan.frames);
  EXPECT_EQ(open()->load()->jobs.size(), 3u);
}

TEST_F(LostCommits, AFlippedBitAnywhereInTheJournalIsRepairedOrReported) {
  const std::uintmax_t size_bytes = std::filesystem::file_size(killed_.path() / journal_.filename());
  int refused = 0;
  constexpr int kPositions = 80;
  for (int i = 0; i < kPositions; ++i) {
    restore();
    const std::uintmax_t at =
        i < 40 ? static_cast<std::uintmax_t>(i) : size_bytes * static_cast<std::uintmax_t>(i) / kPositions;
    flip(journal_, at);
    const std::string journal = bytes_of(journal_);
    const Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    if (!store.ok()) {
      ++refused;
      EXPECT_EQ(store.status().code(), StatusCode::kFailedPrecondition) << at << ": " << store.status();
      EXPECT_TRUE(bytes_of(journal_) == journal) << at << ": a store that is refused stays as it is";
      continue;
    }
    EXPECT_EQ((*store)->load()->jobs.size(), 3u) << at;
  }
  EXPECT_GT(refused, kPositions / 2);
}

TEST_F(LostCommits, AMissingJournalIsNamed) {
  for (const bool in_database : {false, true}) {  // whether earlier commits reached the database
    for (const bool is_there : {false, true}) {
      restore();
      if (in_database) {
        open();  // ends properly, so it needs no journal
        std::filesystem::remove(journal_);
        const auto store = open();
        ASSERT_TRUE(store->load().ok());
        std::filesystem::copy_file(file_, folder_.path() / "copy");
        ASSERT_TRUE(store->commit(std::vector<StoreOp>{PutJob{full_record(4)}}).ok());
        std::filesystem::rename(folder_.path() / "copy", file_);
      }
      std::filesystem::remove(journal_);
      if (is_there) {
        std::ofstream(journal_) << "";
      }
      const Status refused = open_sqlite_store(file_).status();
      EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
      EXPECT_NE(message_of(refused).find(" Its journal (-wal) is missing or empty."), std::string::npos) << refused;
    }
  }
}

TEST_F(LostCommits, AcceptedLossReusesNoJobId) {
  restore();
  std::filesystem::resize_file(journal_, std::filesystem::file_size(journal_) / 2);
  const Status refused = open_sqlite_store(file_).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find("Jobs up to 3 and their results may be lost"), std::string::npos) << refused;
  EXPECT_NE(message_of(refused).find("--accept-loss"), std::string::npos) << refused;
  {
    const auto store = open_sqlite_store(file_, {.accept_loss = true}).value();
    const StoredState state = store->load().value();
    EXPECT_LT(state.jobs.size(), 3u);
    EXPECT_EQ(state.next_job_id, 4u) << "the lost job's id is not given again";
  }
  EXPECT_EQ(open()->load()->next_job_id, 4u) << "nor later";
}

TEST_F(LostCommits, AnOldCopyOfTheDatabaseIsRefused) {
  restore();
  ASSERT_TRUE(open()->load().ok());  // one more commit, of the epoch
  std::filesystem::copy_file(killed_.path() / file_.filename(), file_,
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(open_sqlite_store(file_).status().code(), StatusCode::kFailedPrecondition);
}

TEST_F(LostCommits, ADatabaseWithoutItsRecordIsRefused) {
  restore();
  std::filesystem::remove(chain_);
  EXPECT_EQ(open_sqlite_store(file_).status().code(), StatusCode::kFailedPrecondition);
}

TEST_F(LostCommits, AJournalWithoutItsDatabaseIsRefusedAndKept) {
  for (const bool is_there : {false, true}) {
    restore();
    std::filesystem::remove(file_);
    if (is_there) {
      std::ofstream(file_) << "";
    }
    const std::string journal = bytes_of(journal_);
    const Status status = open_sqlite_store(file_).status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << status;
    EXPECT_NE(message_of(status).find(file_.string() + " is empty or gone"), std::string::npos) << status;
    EXPECT_TRUE(bytes_of(journal_) == journal) << "a database that comes back finds its journal";
    EXPECT_EQ(std::filesystem::exists(file_), is_there);
  }
  EXPECT_TRUE(open_sqlite_store(file_, {.accept_loss = true}).ok());
}

}  // namespace
}  // namespace lightmill::test
