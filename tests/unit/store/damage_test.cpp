// Damage to a coordinator's files: the next coordinator has everything, or names what it lacks.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include <fstream>
#include <random>
#include <set>

#include "common/film/film.h"
#include "server/store/asset_folder.h"
#include "server/store/check_rows.h"
#include "server/store/check_state.h"
#include "server/store/records.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/store_conformance.h"

namespace lightmill::test {

// This program uses the records of the conformance suite, not its tests.
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(StoreConformance);

namespace {

namespace fs = std::filesystem;

constexpr int kRounds = 500;
constexpr std::uint64_t kJobs = 6;

JobRecord job_of_four_tiles(std::uint64_t id) {
  JobRecord record = full_record(id);
  RenderSettings& settings = record.spec.settings;
  settings.width = settings.height = 128;
  settings.crop = {0, 0, 128, 128};
  settings.layers = {LayerSpec{}};
  settings.meters = 0;
  settings.method = "path";
  record.allocation = {};
  return record;
}

PutNode node_of(std::uint64_t job, std::uint32_t tile) {
  const RenderSettings settings = job_of_four_tiles(job).spec.settings;
  const Film film(grid_of(settings), NodeLayout(settings.layers));
  auto node = std::make_shared<Node>();
  node->values.assign(film.expected_values(TileId{tile}, node->range), static_cast<float>(job + tile));
  return {JobId{job}, TileId{tile}, std::move(node)};
}

std::vector<StoreOp> writes_of_job(std::uint64_t id) {
  std::vector<StoreOp> ops{PutJob{job_of_four_tiles(id)}};
  for (std::uint32_t tile = 0; tile < 4; ++tile) {
    ops.push_back(node_of(id, tile));
    ops.push_back(PutResult{{JobId{id}, TileId{tile}, {0, 0}}, Hash128{id, tile}, {"worker", "machine"}, tile == 1});
  }
  Action action;
  action.number = id;
  action.caller = "ada";
  ops.push_back(PutAction{action});
  ops.push_back(PutToken{{fmt::format("token {}", id), "ada", Roles::all(), sha256("t"), "root", 1, 2'000'000'000}});
  ops.push_back(PutQuarantine{{{fmt::format("liar {}", id), "machine"}, "wrong", 5}});
  return ops;
}

/// Contents of a store, item by item.
std::map<std::string, std::string> items_of(const StoredState& state) {
  std::map<std::string, std::string> items;
  for (const StoredState::StoredJob& job : state.jobs) {
    const std::string name = fmt::format("job {}", job.record.id.value);
    StoredState alone;
    alone.renderers = state.renderers;
    alone.jobs.push_back({job.record, {}, {}});
    items[name] = describe(alone);
    for (const StoredState::StoredNode& node : job.nodes) {
      items[fmt::format("{} node of tile {}", name, node.tile.value)] = hash_of(*node.node).hex();
    }
    for (const StoredState::StoredResult& result : job.results) {
      items[fmt::format("{} result of tile {}", name, result.tile.value)] =
          fmt::format("{} {} {}", result.hash.hex(), state.renderers.at(result.by).worker, result.to_verify);
    }
  }
  for (const TokenRecord& token : state.tokens) {
    items[token.id] = fmt::format("{} {} {}", token.name, names_of(token.roles), token.hash.hex());
  }
  for (const Action& action : state.actions) {
    items[fmt::format("action {}", action.number)] = action.caller;
  }
  for (const QuarantineRecord& record : state.quarantine) {
    items[record.of.worker] = record.reason + record.of.identity;
  }
  return items;
}

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

/// Checks that everything that is missing or changed is named.
void expect_named(const StoredState& state, const std::map<std::string, std::string>& before) {
  const std::map<std::string, std::string> now = items_of(state);
  for (const auto& [item, value] : now) {
    const auto old = before.find(item);
    EXPECT_TRUE(old != before.end() && (old->second == value || !state.damaged_entries.empty())) << item << " is other";
  }
  for (const auto& [item, value] : before) {
    if (now.contains(item)) {
      continue;
    }
    bool named = !item.starts_with("job ") && !state.damaged_entries.empty();
    for (const JobId job : state.damaged_jobs) {
      named = named || (item + " ").starts_with(fmt::format("job {} ", job.value));
    }
    for (const NodeKey& key : state.damaged) {
      named = named || item == fmt::format("job {} node of tile {}", key.job.value, key.tile.value);
    }
    for (const DropResultRow& row : state.damaged_results) {
      named = named || item == fmt::format("job {} result of tile {}", row.job.value, row.tile);
    }
    // A vanished result takes along its node, which is named. Its samples are rendered again.
    named = named || (item.find(" result of ") != std::string::npos && !state.damaged.empty());
    EXPECT_TRUE(named) << item << " is gone";
  }
}

TEST_F(Damage, IsNeverSilent) {
  std::map<std::string, std::string> before;
  {
    const auto store = open_sqlite_store(file_).value();
    before = items_of(load_with_films(*store).value());
  }
  ASSERT_EQ(before.size(), kJobs * 12);
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
    const bool named = !state->damaged.empty() || !state->damaged_jobs.empty() || !state->damaged_entries.empty() ||
                       !state->damaged_results.empty();
    ++outcomes[named ? "named" : "harmless"];
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
  sqlite3* handle = nullptr;
  EXPECT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  const std::string sql = fmt::format("SELECT rootpage FROM sqlite_schema WHERE name = '{}'", table);
  EXPECT_EQ(sqlite3_prepare_v2(handle, sql.c_str(), -1, &statement, nullptr), SQLITE_OK);
  EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW);
  const int page = sqlite3_column_int(statement, 0);
  sqlite3_finalize(statement);
  sqlite3_close(handle);
  return page;
}

TEST_F(Damage, ARowThatVanishesFromItsPageIsMissed) {
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
    const Status status = open_sqlite_store(file_).status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << status;
    EXPECT_NE(message_of(status).find(fmt::format("its table {} has lost rows", table.name)), std::string::npos)
        << status;
    file.seekp(at);
    file.put(static_cast<char>(rows)).flush();
  }
  EXPECT_TRUE(open_sqlite_store(file_).ok());
}

}  // namespace
}  // namespace lightmill::test
