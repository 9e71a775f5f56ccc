// Fuzz test of rows of a store: a coordinator that starts on them runs, or names the damage.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include "server/store/check_rows.h"
#include "server/store/records.h"
#include "server/store/row_values.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/fuzz/mutate.h"
#include "tests/support/sqlite_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

const int kRounds = fuzz_cases(500);

std::uint64_t number_in(sqlite3_value* value) {
  return static_cast<std::uint64_t>(sqlite3_value_int64(value));
}

std::string bytes_in(sqlite3_value* value) {
  const auto* first = static_cast<const char*>(sqlite3_value_blob(value));
  return first == nullptr ? std::string() : std::string(first, static_cast<std::size_t>(sqlite3_value_bytes(value)));
}

/// SQL function `result_checksum`: checksum of a result's row; 0 if its hash is invalid.
void result_checksum(sqlite3_context* context, int, sqlite3_value** values) {
  const NodeKey key{
      JobId{number_in(values[0])},
      TileId{static_cast<std::uint32_t>(number_in(values[1]))},
      {static_cast<std::uint32_t>(number_in(values[2])), static_cast<std::uint32_t>(number_in(values[3]))}};
  const Result<Hash128> hash = stored::hash_in(bytes_in(values[4]));
  const Renderer by{bytes_in(values[5]), bytes_in(values[6]), bytes_in(values[7])};
  const auto audit = static_cast<stored::Audit>(number_in(values[8]));
  sqlite3_result_int64(context, hash.ok() ? stored::checksum_of(key, *hash, by, audit) : 0);
}

/// SQL function `record_checksum`: checksum of a row in the table of this number, with this key and message.
void record_checksum(sqlite3_context* context, int, sqlite3_value** values) {
  const stored::Table table{static_cast<std::uint8_t>(number_in(values[0]))};
  const stored::Key key =
      stored::info_of(table).numbered ? stored::Key{number_in(values[1])} : stored::Key{0, bytes_in(values[1])};
  sqlite3_result_int64(context, stored::checksum_of(table, key, bytes_in(values[2])));
}

/// A file with all checks off.
class File : public test::SqliteFile {
 public:
  explicit File(const fs::path& path) : SqliteFile(path) {
    sqlite3_create_function(handle(), "result_checksum", 9, SQLITE_UTF8, nullptr, result_checksum, nullptr, nullptr);
    sqlite3_create_function(handle(), "record_checksum", 3, SQLITE_UTF8, nullptr, record_checksum, nullptr, nullptr);
    turn_checks_off();
  }

  /// Updates the checksums of all rows, except the store's own.
  void make_checksums_fit() {
    for (std::size_t table = 0; table < stored::kTableCount; ++table) {
      const stored::TableInfo& info = stored::kTables[table];
      rows(fmt::format("UPDATE {} SET checksum = record_checksum({}, {}, message)", info.name, table, info.key));
    }
    rows(
        "UPDATE results SET checksum = result_checksum(job, tile, level, range_index, hash, worker, machine, "
        "fingerprint_class, audit)");
  }
};

template <class T>
const T& one_of(const std::vector<T>& values, FuzzRandom& random) {
  return values[random.below(values.size())];
}

/// Changes one column of one table, in all of its rows or in one.
std::string damage(File& file, FuzzRandom& random) {
  static const std::vector<std::string> kValues{"0",
                                                "1",
                                                "-1",
                                                "2147483647",
                                                "2147483648",
                                                "4294967295",
                                                "9223372036854775807",
                                                "-9223372036854775808",
                                                "1e308",
                                                "-1e308",
                                                "''",
                                                "'x'",
                                                "x''",
                                                "zeroblob(100)"};
  const std::string table = one_of(file.rows("SELECT name FROM sqlite_master WHERE type = 'table'"), random);
  const std::string column = one_of(file.rows(fmt::format("SELECT name FROM pragma_table_info('{}')", table)), random);
  const std::vector<std::string> values = file.rows(fmt::format("SELECT {} FROM {}", column, table));
  if (values.empty()) {
    return table + " is empty";
  }
  const std::string& old = one_of(values, random);
  const std::string where = random.below(2) == 0 ? "" : fmt::format(" WHERE CAST({} AS BLOB) = ?1", column);
  switch (random.below(4)) {
    case 0: {
      constexpr std::array<std::string_view, 3> kWords{"\xff\xff\xff\xff", "\n", std::string_view("\0", 1)};
      const std::string bytes = mutate(old, kWords, random);
      file.rows(fmt::format("UPDATE {} SET {} = CAST(?1 AS {})", table, column, random.below(2) == 0 ? "TEXT" : "BLOB"),
                bytes);
      return fmt::format("{}.{} has other bytes", table, column);
    }
    case 1:
      file.rows(fmt::format("DELETE FROM {}{}", table, where), old);
      return fmt::format("rows of {} are gone", table);
    case 2: {
      const std::string change = fmt::format("{} + {}", column, random.below(2) == 0 ? "1" : "-1");
      file.rows(fmt::format("UPDATE OR IGNORE {} SET {} = {}{}", table, column, change, where), old);
      return fmt::format("{}.{} = {}", table, column, change);
    }
    default: {
      const std::string& value = one_of(kValues, random);
      file.rows(fmt::format("UPDATE OR IGNORE {} SET {} = {}{}", table, column, value, where), old);
      return fmt::format("{}.{} = {}{}", table, column, value, where);
    }
  }
}

class StoredFuzz : public test::CoordinatorTest {
 protected:
  StoredFuzz() { limits.film_bytes = std::uint64_t{1} << 30; }

  /// Job with two small tiles, so that a million cases take minutes.
  static JobSpec small(const std::string& request, std::uint64_t samples) {
    return spec(request, samples, {0, 0, 68, 3});
  }

  /// Makes jobs of all kinds: done, extended, half rendered, adaptive, without a method yet, and cancelled.
  void make_jobs() {
    const SessionId worker = connect("w", 2);
    JobSpec audited = small("done", 4);
    audited.audit_share = 1;
    submit(audited);
    JobSpec layered = small("layers", 4);
    layered.settings.layers = film_layers(std::vector<std::string>{"normal"}).value();
    submit(layered);
    JobSpec by_error = small("error", 64);
    by_error.goal.error = 0.5;
    submit(by_error);
    JobSpec adaptive = small("adaptive", 64);
    adaptive.goal.adaptive = true;
    submit(adaptive);
    ASSERT_TRUE(coordinator->submit(small("open", 16), now, unix_ms(), effects, {true, {}, {}, {"path", "ao"}}).ok());
    flush();
    work(worker);
    const JobId half = submit(small("half", 1024));
    const LeaseGrant grant = got<LeaseGrant>(worker).back();
    say(worker, result(grant, grant.unit.tiles[0]));
    const JobId stopped = submit(small("stopped", 16));
    EXPECT_TRUE(coordinator->cancel(stopped, now, unix_ms(), effects).ok());
    EXPECT_TRUE(coordinator->pause(half, now, effects).ok());
    flush();
    writes.push_back(PutQuarantine{{{"liar", "machine"}, "it lied", 5}});
    TokenRecord token;
    token.id = "0123456789ab";
    token.name = "somebody";
    token.roles.add(Role::view);
    writes.push_back(PutToken{token});
    Action action;
    action.number = 1;
    action.change = "priority 0 -> 1";
    writes.push_back(PutAction{action});
  }

  /// Answers film reads of the coordinator.
  void read_films(Store& store) {
    while (!film_reads.empty()) {
      StoredFilm film;
      const JobId job = std::exchange(film_reads, {}).front();  // one at a time
      for (std::optional<FilmPosition> last = FilmPosition{}; last;) {
        FilmPiece piece = store.read_film(job, *last).value();
        std::ranges::move(piece.nodes, std::back_inserter(film));
        last = piece.last;
      }
      coordinator->film_read(job, std::move(film), now, effects);
      stand_still({});
    }
  }
  /// Runs a coordinator for a while.
  void start(StoredState state, Store& store) {
    film_reads.clear();
    sent.clear();
    writes.clear();
    worked.clear();
    restart(std::move(state));
    stand_still(std::chrono::seconds(60));
    const SessionId worker = connect("again", 2);
    for (const JobStatus& job : coordinator->jobs(now)) {
      (void)coordinator->use_film(job.id, now, effects);
      flush();
      read_films(store);
      EXPECT_NE(coordinator->film(job.id), nullptr);
      (void)coordinator->resume(job.id, now, effects);
      flush();
    }
    for (std::size_t i = 0; i < 20 && i < got<LeaseGrant>(worker).size(); ++i) {
      const LeaseGrant grant = got<LeaseGrant>(worker)[i];
      if (grant.unit.tiles.size() < 100) {
        finish(worker, grant);
      }
    }
    stand_still(std::chrono::seconds(60));
  }
};

TEST_F(StoredFuzz, DamagedRowsAreRefusedOrACoordinatorStartsOnThem) {
  const test::TemporaryFolder folder;
  const fs::path sound = folder.path() / "sound.sqlite", damaged = folder.path() / "damaged.sqlite";
  make_jobs();
  {
    const auto store = open_sqlite_store(sound);
    ASSERT_TRUE(store.ok()) << store.status();
    ASSERT_TRUE((*store)->load().ok());
    ASSERT_TRUE((*store)->commit(writes).ok());
  }
  spdlog::set_level(spdlog::level::off);
  FuzzRandom random(20);
  int accepted = 0, refused = 0;
  for (int round = 0; round < kRounds; ++round) {
    fs::copy_file(sound, damaged, fs::copy_options::overwrite_existing);
    std::string what;
    {
      File file(damaged);
      what = damage(file, random);
      if (random.below(2) == 0) {  // then only the values can show the damage
        file.make_checksums_fit();
      }
    }
    SCOPED_TRACE(fmt::format("round {}: {}", round, what));
    auto store = open_sqlite_store(damaged, {.accept_loss = true});
    Result<StoredState> state = store.ok() ? (*store)->load() : Result<StoredState>(store.status());
    std::vector<StoreOp> repairs;
    if (const Status status = state.ok() ? remove_invalid_rows(*state, repairs) : state.status(); !status.ok()) {
      ++refused;
      EXPECT_FALSE(message_of(status).empty());
      continue;
    }
    report_lost_nodes(*state);
    EXPECT_TRUE(repairs.empty() || (*store)->commit(repairs).ok());
    const bool noticed = !state->damaged.empty() || !state->damaged_entries.empty() ||
                         !state->damaged_results.empty() || !state->damaged_jobs.empty();
    ++(noticed ? refused : accepted);
    start(*std::move(state), **store);
  }
  spdlog::set_level(spdlog::level::info);
  EXPECT_GT(accepted, kRounds / 10);
  EXPECT_GT(refused, kRounds / 10);
}

}  // namespace
}  // namespace lightmill
