// Pages of a database that are of an earlier commit: a write that the disk lost, or that went elsewhere. Such a page is
// valid, and so is each row in it.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <set>

#include "server/store/check_rows.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/sqlite_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/store/stored_examples.h"
#include "tests/unit/store/stored_items.h"

namespace lightmill::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPageBytes = 16384;
constexpr PixelRect kSmall{60, 60, 8, 8};

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

PutNode node_with(std::uint64_t job, float value) {
  for (const StoreOp& op : writes_of_job(job, kSmall)) {
    if (const auto* put = std::get_if<PutNode>(&op)) {
      auto node = std::make_shared<Node>(*put->node);
      node->values.assign(node->values.size(), value);
      return {put->job, put->tile, std::move(node)};
    }
  }
  return {};
}

std::vector<StoreOp> jobs(std::uint64_t first, std::uint64_t last) {
  std::vector<StoreOp> ops;
  for (std::uint64_t id = first; id <= last; ++id) {
    std::ranges::move(writes_of_job(id, kSmall), std::back_inserter(ops));
  }
  return ops;
}

/// Commits of all kinds. Jobs 1 and 2 have nodes of many pages and of few bytes.
std::vector<std::vector<StoreOp>> history() {
  const NodeKey first{JobId{2}, TileId{0}, {0, 0}};
  std::vector<std::vector<StoreOp>> commits{
      writes_of_job(1),
      jobs(2, 2),
      {PutProgress{JobId{1}, 7, 8, {}}, PutAudited{{JobId{1}, TileId{1}, {0, 0}}},
       PutToken{{"token 1", "eve", {Role::view}, sha256("t"), "root", 1, 2}},
       PutQuarantine{{{"liar 1", "machine"}, "wrong again", 6}}},
      {node_with(2, 0.25f), PutResult{first, Hash128{9, 9}, {"another", "machine"}}},
      jobs(3, 60),
      {DropToken{"token 9"}, DropQuarantine{"liar 9"}, DropAction{9}},
      {}};
  for (std::uint64_t id = 10; id <= 50; ++id) {
    commits.back().push_back(DeleteJobRows{JobId{id}});
  }
  commits.push_back(jobs(61, 70));
  commits.push_back(
      {node_with(2, 0.5f), PutResult{first, Hash128{9, 8}, {"worker", "machine"}}, PutProgress{JobId{2}, 70, 80, {}}});
  // No key changes any more.
  PutJob changed = std::get<PutJob>(writes_of_job(2, kSmall).front());
  changed.record.reason = "another one";
  commits.push_back({changed, PutToken{{"token 2", "eve", {Role::view}, sha256("t"), "root", 1, 2}},
                     PutQuarantine{{{"liar 2", "machine"}, "wrong again", 6}}});
  commits.push_back({node_with(2, 0.75f), PutResult{first, Hash128{9, 7}, {"worker", "machine"}}});
  return commits;
}

class OldPages : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const std::vector<StoreOp>& ops : history()) {
      {
        const auto store = open_sqlite_store(file_).value();
        ASSERT_TRUE(store->load().ok());
        ASSERT_TRUE(store->commit(ops).ok());
      }
      versions_.push_back(bytes_of(file_));  // closing has written the journal into the database
    }
    chain_bytes_ = bytes_of(chain_);
    for (int page = 1; page <= pages(); ++page) {
      kinds_[page] = "free or map";
    }
    kinds_[1] = "sqlite_schema";
    SqliteFile(file_).run(
        "SELECT pageno, name, pagetype FROM dbstat", [](sqlite3_stmt*) {},
        [&](sqlite3_stmt* row) {
          kinds_[sqlite3_column_int(row, 0)] = column_bytes(row, 1) + ", " + column_bytes(row, 2);
        });
  }
  int pages() const { return static_cast<int>(versions_.back().size() / kPageBytes); }
  static std::string page_of(const std::string& file, int page) {
    const std::size_t at = static_cast<std::size_t>(page - 1) * kPageBytes;
    return at < file.size() ? file.substr(at, kPageBytes) : "";
  }
  void put(const std::string& database) const {
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      fs::remove(entry);
    }
    std::ofstream(file_, std::ios::binary) << database;
    std::ofstream(chain_, std::ios::binary) << chain_bytes_;
  }

  /// Starts a coordinator. Returns what came of it.
  std::string start(const std::map<std::string, std::string>& before) const {
    const Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    Result<StoredState> state = store.ok() ? load_with_films(**store) : Result<StoredState>(store.status());
    std::vector<StoreOp> repairs;
    if (const Status status = state.ok() ? remove_invalid_rows(*state, repairs) : state.status(); !status.ok()) {
      EXPECT_TRUE(status.code() == StatusCode::kDataLoss || status.code() == StatusCode::kFailedPrecondition) << status;
      return "refused";
    }
    report_lost_nodes(*state);
    expect_named(*state, before);
    return names_damage(*state) ? "named" : "harmless";
  }
  /// Writes to the store, which takes free pages and gives some back. False if it is damaged.
  bool write_more() const {
    const Result<std::unique_ptr<Store>> store = open_sqlite_store(file_);
    const auto more = jobs(71, 90);
    std::vector<StoreOp> less;
    for (std::uint64_t id = 71; id <= 90; ++id) {
      less.push_back(DeleteJobRows{JobId{id}});
      less.push_back(DropToken{fmt::format("token {}", id)});
      less.push_back(DropAction{id});
      less.push_back(DropQuarantine{fmt::format("liar {}", id)});
    }
    return store.ok() && (*store)->load().ok() && (*store)->commit(more).ok() && (*store)->commit(less).ok();
  }

  const TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "lightmill.sqlite";
  const fs::path chain_ = folder_.path() / "lightmill.sqlite-chain";
  std::vector<std::string> versions_;  ///< the database after each commit
  std::string chain_bytes_;            ///< after the last one
  std::map<int, std::string> kinds_;   ///< of the last version's pages
};

TEST_F(OldPages, AreNeverSilent) {
  const std::map<std::string, std::string> before =
      items_of(load_with_films(*open_sqlite_store(file_).value()).value());
  spdlog::set_level(spdlog::level::off);
  std::map<std::string, std::map<std::string, int>> outcomes;
  std::map<std::string, int> found;
  for (int page = 1; page <= pages(); ++page) {
    std::set<std::string> tried{page_of(versions_.back(), page)};
    for (std::size_t version = 0; version + 1 < versions_.size(); ++version) {
      const std::string old = page_of(versions_[version], page);
      if (old.empty() || !tried.insert(old).second) {
        continue;
      }
      SCOPED_TRACE(fmt::format("page {} ({}) of version {}", page, kinds_[page], version));
      std::string database = versions_.back();
      database.replace(static_cast<std::size_t>(page - 1) * kPageBytes, kPageBytes, old);
      put(database);
      std::string outcome = start(before);
      if (outcome == "harmless") {
        outcome = write_more() ? start(before) : "refused";
      }
      ++outcomes[kinds_[page]][outcome];
      found[kinds_[page]] += outcome == "harmless" ? 0 : 1;
    }
  }
  spdlog::set_level(spdlog::level::info);
  for (const auto& [kind, of_kind] : outcomes) {
    for (const auto& [outcome, count] : of_kind) {
      fmt::print("{}: {} {}\n", kind, count, outcome);
    }
  }
  for (const char* const table : {"store", "jobs", "job_specs", "job_progress", "nodes", "sqlite_autoindex_nodes_1",
                                  "results", "tokens", "quarantine", "actions"}) {
    EXPECT_GT(found[fmt::format("{}, leaf", table)], 0) << table;
  }
}

TEST_F(OldPages, ADatabaseOfAnEarlierCommitIsRefused) {
  for (std::size_t version = 0; version + 1 < versions_.size(); ++version) {
    put(versions_[version]);
    const Status status = open_sqlite_store(file_).status();
    EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition) << status;
    EXPECT_NE(message_of(status).find("but commits up to"), std::string::npos) << status;
  }
}

}  // namespace
}  // namespace lightmill::test
