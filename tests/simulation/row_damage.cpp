#include "tests/simulation/row_damage.h"

#include <fmt/ranges.h>

#include <cstring>
#include <optional>
#include <vector>

#include "common/film/node.h"
#include "server/store/row_sums.h"
#include "server/store/row_values.h"
#include "server/store/sqlite/store_row.h"
#include "tests/support/sqlite_file.h"

namespace lightmill::simulation {
namespace {

/// A file with all checks off.
struct UncheckedFile : test::SqliteFile {
  explicit UncheckedFile(const std::filesystem::path& path) : SqliteFile(path) { turn_checks_off(); }
};

/// Row, as SQL names it.
struct Row {
  std::string table, where;
};

Row draw_row(UncheckedFile& file, Random& random) {
  std::vector<std::string> tables = file.rows("SELECT name FROM sqlite_master WHERE type = 'table'");
  std::erase_if(tables, [&](const std::string& table) {
    return file.rows(fmt::format("SELECT 1 FROM {} LIMIT 1", table)).empty();
  });
  const std::string& table = tables[random.below(tables.size())];
  std::vector<std::string> key = file.rows(fmt::format("SELECT name FROM pragma_table_info('{}') WHERE pk > 0", table));
  if (key.empty()) {
    key = {"rowid"};
  }
  const std::uint64_t rows = std::stoull(file.rows(fmt::format("SELECT count(*) FROM {}", table)).at(0));
  const std::string columns = fmt::format("{}", fmt::join(key, ", "));
  return {table, fmt::format("({0}) = (SELECT {0} FROM {1} LIMIT 1 OFFSET {2})", columns, table, random.below(rows))};
}

void flip(std::string& bytes, Random& random) {
  if (!bytes.empty()) {
    bytes[random.below(bytes.size())] ^= static_cast<char>(1 << random.below(8));
  }
}

}  // namespace

std::string flip_bit_in_row(const std::filesystem::path& database, Random& random) {
  UncheckedFile file(database);
  const Row row = draw_row(file, random);
  const std::vector<std::string> columns =
      file.rows(fmt::format("SELECT name FROM pragma_table_info('{}')", row.table));
  const std::string& column = columns[random.below(columns.size())];
  int type = SQLITE_NULL;
  std::int64_t number = 0;
  std::string bytes;
  file.run(
      fmt::format("SELECT {} FROM {} WHERE {}", column, row.table, row.where), [](sqlite3_stmt*) {},
      [&](sqlite3_stmt* found) {
        type = sqlite3_column_type(found, 0);
        number = sqlite3_column_int64(found, 0);
        bytes = test::column_bytes(found, 0);
      });
  number ^= static_cast<std::int64_t>(std::uint64_t{1} << random.below(64));
  flip(bytes, random);
  file.run(
      fmt::format("UPDATE OR IGNORE {} SET {} = ?1 WHERE {}", row.table, column, row.where),
      [&](sqlite3_stmt* update) {
        if (type == SQLITE_INTEGER) {
          sqlite3_bind_int64(update, 1, number);
        } else if (type == SQLITE_TEXT) {
          sqlite3_bind_text(update, 1, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
        } else {
          sqlite3_bind_blob(update, 1, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
        }
      },
      [](sqlite3_stmt*) {});
  return row.table;
}

std::string lose_row(const std::filesystem::path& database, Random& random) {
  UncheckedFile file(database);
  const Row row = draw_row(file, random);
  file.rows(fmt::format("DELETE FROM {} WHERE {}", row.table, row.where));
  return row.table;
}

namespace {

/// Makes the store's sums agree with another hash of a node.
void forge_sums(const std::filesystem::path& path, JobId job, TileId tile, const Node& node, const std::string& before,
                const std::string& after) {
  sqlite::Database database = sqlite::Database::open(path).value();
  sqlite::StoreRow row = sqlite::read_store_row(database).value();
  stored::RowSums sums = stored::RowSums::from_bytes(row.sums).value();
  const FilmPosition place{tile.value, node.range.level, node.range.index};
  sums.count_node(job, place, before, false);
  sums.count_node(job, place, after, true);
  row.sums = sums.bytes();
  LM_CHECK(sqlite::StoreRowWriter::prepare(database).value().write(row).ok());
}

}  // namespace

bool forge_node(const std::filesystem::path& database, Random& random) {
  std::optional<UncheckedFile> opened(database);
  UncheckedFile& file = *opened;
  const std::vector<std::string> ids = file.rows("SELECT id FROM nodes");
  if (ids.empty()) {
    return false;
  }
  const std::string& id = ids[random.below(ids.size())];
  Node node;
  JobId job;
  TileId tile;
  std::string before;
  file.run(
      "SELECT level, range_index, non_finite, samples, job, tile, hash FROM nodes WHERE id = " + id,
      [](sqlite3_stmt*) {},
      [&](sqlite3_stmt* row) {
        job.value = static_cast<std::uint64_t>(sqlite3_column_int64(row, 4));
        tile.value = static_cast<std::uint32_t>(sqlite3_column_int64(row, 5));
        node.range = {static_cast<std::uint32_t>(sqlite3_column_int64(row, 0)),
                      static_cast<std::uint32_t>(sqlite3_column_int64(row, 1))};
        node.non_finite = static_cast<std::uint32_t>(sqlite3_column_int64(row, 2));
        before = test::column_bytes(row, 6);
        const std::string bytes = test::column_bytes(row, 3);
        node.values.resize(bytes.size() / sizeof(float));
        std::memcpy(node.values.data(), bytes.data(), bytes.size());
      });
  node.values.at(random.below(node.values.size())) += 1;
  const std::string hash = hash_bytes(stored::row_hash_of(job, tile, node));
  file.run(
      "UPDATE nodes SET samples = ?1, hash = ?2 WHERE id = " + id,
      [&](sqlite3_stmt* update) {
        sqlite3_bind_blob(update, 1, node.values.data(), static_cast<int>(node.values.size() * sizeof(float)),
                          SQLITE_TRANSIENT);
        sqlite3_bind_blob(update, 2, hash.data(), static_cast<int>(hash.size()), SQLITE_TRANSIENT);
      },
      [](sqlite3_stmt*) {});
  opened.reset();
  forge_sums(database, job, tile, node, before, hash);
  return true;
}

}  // namespace lightmill::simulation
