// Damage to a coordinator's files: the next coordinator has everything, or names what it lacks.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <random>

#include "server/store/check_rows.h"
#include "server/store/records.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/sqlite_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/stored_examples.h"
#include "tests/unit/store/stored_items.h"

namespace lightmill::test {
namespace {

namespace fs = std::filesystem;

constexpr int kRounds = 500;
constexpr std::uint64_t kJobs = 6;

/// A coordinator's folder after kill -9: half of it in the database, half in the journal.
class Damage : public ::testing::Test {
 protected:
  void SetUp() override {
    {
      const auto store = open_sqlite_store(file_).value();
      ASSERT_TRUE(store->load().ok());
      for (std::uint64_t id = 1; id <= kJobs / 2; ++id) {
        ASSERT_TRUE(store->commit(writes_of_job(id)).ok());
      }
    }
    const auto store = open_sqlite_store(file_).value();
    ASSERT_TRUE(store->load().ok());
    for (std::uint64_t id = kJobs / 2 + 1; id <= kJobs; ++id) {
      ASSERT_TRUE(store->commit(writes_of_job(id)).ok());
    }
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      std::ifstream in(entry.path(), std::ios::binary);
      files_[entry.path().filename().string()] = {std::istreambuf_iterator<char>(in), {}};
    }
    ASSERT_EQ(files_.size(), 3u);
  }

  /// Puts the files back with one of them damaged. Returns what was damaged.
  std::string damage(std::mt19937_64& random) {
    auto files = files_;
    auto at = files.begin();
    std::advance(at, random() % files.size());
    std::string& bytes = at->second;
    const std::size_t place = random() % bytes.size(), sector = place / 512 * 512;
    std::string how;
    switch (random() % 6) {
      case 0:
        bytes[place] ^= static_cast<char>(1 << random() % 8);
        how = "a flipped bit";
        break;
      case 1:
        bytes.replace(sector, 512, 512, '\0');
        how = "zeros in a sector";
        break;
      case 2: {
        const std::string other = bytes.substr(random() % bytes.size() / 512 * 512, 512);
        bytes.replace(sector, other.size(), other);
        how = "another sector's bytes in a sector";
        break;
      }
      case 3:
        bytes.resize(place);
        how = "a file that is cut off";
        break;
      case 4: {
        std::string noise(512, '\0');
        std::ranges::generate(noise, [&] { return static_cast<char>(random()); });
        bytes.replace(sector, 512, noise);
        how = "noise in a sector";
        break;
      }
      default:
        how = "a file that is gone";
        files.erase(at);
        at = files.end();
    }
    const std::string name = at == files.end() ? "" : at->first;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      fs::remove(entry);
    }
    for (const auto& [file, content] : files) {
      std::ofstream(folder_.path() / file, std::ios::binary) << content;
    }
    return fmt::format("{} of {}, at {}", how, name, place);
  }

  const TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "lightmill.sqlite";
  std::map<std::string, std::string> files_;
};

TEST_F(Damage, IsRepairedOrReported) {
  std::map<std::string, std::string> before;
  {
    const auto store = open_sqlite_store(file_).value();
    before = items_of(load_with_films(*store).value());
  }
  ASSERT_EQ(before.size(), kJobs * kItemsOfAJob);
  spdlog::set_level(spdlog::level::off);
  std::mt19937_64 random(1);
  std::map<std::string, int> outcomes;
  for (int round = 0; round < kRounds; ++round) {
    SCOPED_TRACE(fmt::format("round {}: {}", round, damage(random)));
    const Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    Result<StoredState> state = store.ok() ? load_with_films(**store) : Result<StoredState>(store.status());
    std::vector<StoreOp> repairs;
    if (const Status status = state.ok() ? remove_invalid_rows(*state, repairs) : state.status(); !status.ok()) {
      ++outcomes["refused"];
      EXPECT_TRUE(status.code() == StatusCode::kDataLoss || status.code() == StatusCode::kFailedPrecondition ||
                  status.code() == StatusCode::kUnavailable)
          << status;
      EXPECT_FALSE(message_of(status).empty());
      continue;
    }
    report_lost_nodes(*state);
    expect_named(*state, before);
    EXPECT_GE(state->next_job_id, kJobs + 1);
    ++outcomes[names_damage(*state) ? "named" : "harmless"];
  }
  spdlog::set_level(spdlog::level::info);
  for (const auto& [outcome, count] : outcomes) {
    RecordProperty(outcome, count);
    fmt::print("{}: {}\n", outcome, count);
  }
  EXPECT_GT(outcomes["refused"], kRounds / 10);
  EXPECT_GT(outcomes["named"], kRounds / 50);
}

/// The first page of a table.
int root_page(const fs::path& file, const std::string& table) {
  return std::stoi(
      SqliteFile(file).rows(fmt::format("SELECT rootpage FROM sqlite_schema WHERE name = '{}'", table)).at(0));
}

TEST_F(Damage, ARowThatVanishesFromItsPageIsDetected) {
  open_sqlite_store(file_).value();  // all of it in the database
  constexpr std::streamoff kPageBytes = 16384, kRowsLowByte = 4;
  for (const stored::TableInfo& table : stored::kTables) {
    const std::streamoff at = (root_page(file_, table.name) - 1) * kPageBytes + kRowsLowByte;
    std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(at);
    const int rows = file.get();
    ASSERT_EQ(rows, static_cast<int>(kJobs)) << table.name;
    file.seekp(at);
    file.put(static_cast<char>(rows - 1)).flush();
    const Status status = open_sqlite_store(file_).value()->load().status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << status;
    EXPECT_NE(message_of(status).find(fmt::format("its table {} has lost rows", table.name)), std::string::npos)
        << status;
    file.seekp(at);
    file.put(static_cast<char>(rows)).flush();
  }
  EXPECT_TRUE(open_sqlite_store(file_).value()->load().ok());
}

}  // namespace
}  // namespace lightmill::test
