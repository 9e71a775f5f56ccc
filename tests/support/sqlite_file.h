// A store's SQLite file, which a test reads and changes without the store.
#pragma once

#include <sqlite3.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/check.h"

namespace lightmill::test {

/// Bytes of a column; empty for NULL.
inline std::string column_bytes(sqlite3_stmt* row, int column) {
  const auto* const bytes = static_cast<const char*>(sqlite3_column_blob(row, column));
  return bytes == nullptr ? "" : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(row, column)));
}

/// Not thread-safe.
class SqliteFile {
 public:
  explicit SqliteFile(const std::filesystem::path& path) {
    LM_CHECK(sqlite3_open(path.c_str(), &handle_) == SQLITE_OK, "{}", path.string());
  }
  ~SqliteFile() { sqlite3_close(handle_); }
  SqliteFile(const SqliteFile&) = delete;
  SqliteFile& operator=(const SqliteFile&) = delete;

  sqlite3* handle() const { return handle_; }

  /// Statements may break constraints from now on, and do not wait for the disk.
  void turn_checks_off() {
    execute("PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON; PRAGMA synchronous = OFF");
  }
  void execute(const std::string& sql) {
    LM_CHECK(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK, "{}: {}", sql,
             sqlite3_errmsg(handle_));
  }
  /// Runs one statement. `bind` sets its parameters, and `each` gets its rows. False if the statement is invalid.
  template <class Bind, class Each>
  bool run(const std::string& sql, const Bind& bind, const Each& each) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(handle_, sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      return false;
    }
    bind(statement);
    while (sqlite3_step(statement) == SQLITE_ROW) {
      each(statement);
    }
    sqlite3_finalize(statement);
    return true;
  }
  /// First column of a statement's rows, as bytes. None if the statement is invalid. `blob`: its parameter.
  std::vector<std::string> rows(const std::string& sql, std::string_view blob = {}) {
    std::vector<std::string> found;
    run(
        sql,
        [&](sqlite3_stmt* statement) {
          sqlite3_bind_blob(statement, 1, blob.data(), static_cast<int>(blob.size()), SQLITE_STATIC);
        },
        [&](sqlite3_stmt* row) { found.push_back(column_bytes(row, 0)); });
    return found;
  }

 private:
  sqlite3* handle_ = nullptr;
};

}  // namespace lightmill::test
