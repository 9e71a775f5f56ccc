// Damage to a coordinator's rows in PostgreSQL: the next coordinator has everything, or names what it lacks.
// LIGHTMILL_DAMAGE_ROUNDS=n damages n times the rows.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <sstream>

#include "server/store/check_rows.h"
#include "server/store/check_state.h"
#include "tests/integration/store/postgres_fixture.h"
#include "tests/unit/store/stored_items.h"

namespace lightmill::test {
namespace {

constexpr std::uint64_t kJobs = 3;

struct Column {
  std::string name, type;
  bool is_key = false;
};
struct Damage {
  std::string table, what, sql;
};

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

/// Whether something is missing afterwards, or is in the place of something else.
bool is_severe(const Damage& damage) {
  const bool moved = damage.what == "two rows are swapped" || damage.what == "a row is overwritten by another one";
  return damage.what == "a row is lost" || (moved && damage.table != "assets");
}

class PostgresDamage : public ::testing::Test {
 protected:
  void SetUp() override {
    {
      const PostgresStores stores = open_postgres(options()).value();
      ASSERT_TRUE(stores.store->load().ok());
      for (std::uint64_t id = 1; id <= kJobs; ++id) {
        ASSERT_TRUE(stores.store->commit(writes_of_job(id, {60, 60, 8, 8})).ok());
        const std::string bytes = fmt::format("asset {}", id);
        const auto upload = stores.assets->start_upload(sha256(bytes)).value();
        ASSERT_TRUE(upload->append(as_byte_view(bytes)).ok() && upload->finish().ok());
      }
    }
    tables_ =
        words_of(sql("SELECT string_agg(relname, ' ' ORDER BY relname) FROM pg_class WHERE relkind = 'r' AND "
                     "relnamespace = 'lightmill'::regnamespace"));
    // A row that is lost takes no others along.
    for (const std::string& key : words_of(sql(
             "SELECT string_agg(conrelid::regclass || '/' || conname, ' ') FROM pg_constraint WHERE contype = 'f'"))) {
      const std::size_t slash = key.find('/');
      sql(fmt::format("ALTER TABLE {} DROP CONSTRAINT {}", key.substr(0, slash), key.substr(slash + 1)));
    }
    sql("CREATE SCHEMA sound");
    for (const std::string& table : tables_) {
      sql(fmt::format("CREATE TABLE sound.{0} AS TABLE lightmill.{0}", table));
      restore_ += fmt::format(
          "DELETE FROM lightmill.{0}; INSERT INTO lightmill.{0} OVERRIDING SYSTEM VALUE TABLE sound.{0};", table);
    }
  }

  PostgresOptions options() const {
    PostgresOptions options;
    options.url = url_;
    options.wait = [](std::chrono::milliseconds) { return false; };
    options.on_deposed = [](const Status&) {};
    return options;
  }
  std::string sql(const std::string& text) const { return run_sql(url_, text); }

  /// Columns, but for those that the database numbers itself.
  std::vector<Column> columns_of(const std::string& table) const {
    std::vector<Column> columns;
    for (const std::string& word : words_of(sql(
             fmt::format("SELECT string_agg(attname || '/' || atttypid || '/' || coalesce(indisprimary, "
                         "false), ' ' ORDER BY attnum) FROM pg_attribute LEFT JOIN pg_index ON indrelid = attrelid AND "
                         "indisprimary AND attnum = ANY (indkey) WHERE attrelid = 'lightmill.{}'::regclass AND "
                         "attnum > 0 AND attidentity = ''",
                         table)))) {
      const std::size_t first = word.find('/'), second = word.rfind('/');
      columns.push_back(
          {word.substr(0, first), word.substr(first + 1, second - first - 1), word.substr(second + 1) == "true"});
    }
    return columns;
  }

  /// Another value of the column.
  static std::string changed(const Column& column, int round) {
    if (column.type == "20") {  // BIGINT
      return fmt::format("{} # (1::bigint << {})", column.name, (round * 13 + 1) % 64);
    }
    if (column.type == "17") {  // BYTEA
      return fmt::format(
          "CASE WHEN length({0}) = 0 THEN '\\x01' ELSE set_bit({0}, {1} % (8 * length({0})), 1 - get_bit({0}, {1} % (8 * "
          "length({0})))) END",
          column.name, round * 1'237);
    }
    return column.type == "25" ? column.name + " || '?'" : "now() + interval '3 years'";
  }

  /// Place of a row of the table in an order that the round draws.
  static std::string row(const std::string& table, int round, int place = 0) {
    return fmt::format("(SELECT ctid FROM lightmill.{} ORDER BY md5(ctid::text || '{}') LIMIT 1 OFFSET {})", table,
                       round, place);
  }

  /// All damages of a table.
  std::vector<Damage> damages_of(const std::string& table, int round) const {
    const std::vector<Column> columns = columns_of(table);
    std::vector<Damage> damages{
        {table, "a row is lost", fmt::format("DELETE FROM lightmill.{} WHERE ctid = {}", table, row(table, round))}};
    std::string others;
    bool has_key = false;
    for (const Column& column : columns) {
      damages.push_back({table, column.name + " is changed",
                         fmt::format("UPDATE lightmill.{} SET {} = {} WHERE ctid = {}", table, column.name,
                                     changed(column, round), row(table, round))});
      has_key = has_key || column.is_key;
      others += column.is_key ? "" : (others.empty() ? "" : ", ") + column.name;
    }
    if (!has_key && table != "assets") {
      damages.push_back(
          {table, "a row is there twice", fmt::format("INSERT INTO lightmill.{0} TABLE sound.{0}", table)});
      return damages;
    }
    if (table == "current_epoch") {
      return damages;  // it has one row
    }
    for (const bool both : {true, false}) {
      damages.push_back(
          {table, both ? "two rows are swapped" : "a row is overwritten by another one",
           fmt::format("UPDATE lightmill.{0} AS each SET ({1}) = (SELECT {1} FROM lightmill.{0} AS other "
                       "WHERE other.ctid = CASE WHEN each.ctid = {2} THEN {3} ELSE {2} END) WHERE each.ctid "
                       "= {2} OR ({4} AND each.ctid = {3})",
                       table, others, row(table, round), row(table, round, 1), both)});
    }
    return damages;
  }

  /// Starts a coordinator. Returns what came of it.
  std::string restart(const Damage& damage, const StoredState& sound) const {
    const std::map<std::string, std::string> before = items_of(sound);
    const Result<PostgresStores> stores = open_postgres(options());
    if (stores.status().code() == StatusCode::kCancelled) {
      EXPECT_EQ(damage.table, "lease") << "it waits for a coordinator that is not there";
      return "waits";
    }
    Result<StoredState> state = stores.ok() ? load_with_films(*stores->store) : Result<StoredState>(stores.status());
    std::vector<StoreOp> repairs;
    if (const Status status = state.ok() ? remove_invalid_rows(*state, repairs) : state.status(); !status.ok()) {
      EXPECT_TRUE(status.code() == StatusCode::kDataLoss || status.code() == StatusCode::kFailedPrecondition) << status;
      EXPECT_FALSE(message_of(status).empty());
      return "refused";
    }
    report_lost_nodes(*state);
    expect_named(*state, before);
    EXPECT_EQ(state->next_job_id, kJobs + 1);
    EXPECT_EQ(state->secret, sound.secret);
    EXPECT_GE(state->epoch, sound.epoch);
    const std::uint64_t assets = check_assets(*stores->assets)->assets;
    EXPECT_TRUE(assets == kJobs || damage.table.starts_with("asset"));
    return names_damage(*state) ? "named" : assets < kJobs ? "sent again" : "harmless";
  }

  const std::string url_ = server().new_database();
  std::vector<std::string> tables_;
  std::string restore_;
};

TEST_F(PostgresDamage, IsRepairedOrReported) {
  const StoredState sound = load_with_films(*open_postgres(options()).value().store).value();
  ASSERT_EQ(items_of(sound).size(), kJobs * kItemsOfAJob);
  ASSERT_EQ(tables_.size(), 15u);
  spdlog::set_level(spdlog::level::off);
  std::map<std::string, std::map<std::string, int>> outcomes;
  int damages = 0;
  const char* const wanted = std::getenv("LIGHTMILL_DAMAGE_ROUNDS");
  const int rounds = wanted == nullptr ? 1 : std::atoi(wanted);
  for (int round = 0; round < rounds; ++round) {
    for (const std::string& table : tables_) {
      for (const Damage& damage : damages_of(table, round)) {
        SCOPED_TRACE(fmt::format("{}: {}, round {}", damage.table, damage.what, round));
        // A value that another row has is refused by the database itself.
        sql(restore_ +
            fmt::format("DO $do$ BEGIN {}; EXCEPTION WHEN unique_violation THEN NULL; END $do$", damage.sql));
        const std::string outcome = restart(damage, sound);
        EXPECT_TRUE(outcome != "harmless" || !is_severe(damage));
        ++outcomes[table][outcome];
        ++damages;
      }
    }
  }
  spdlog::set_level(spdlog::level::info);
  EXPECT_GT(damages, 90 * rounds);
  for (const auto& [table, of_table] : outcomes) {
    for (const auto& [outcome, count] : of_table) {
      fmt::print("{}: {} {}\n", table, count, outcome);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
