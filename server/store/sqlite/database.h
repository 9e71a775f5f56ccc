// Wrappers of an SQLite connection and its prepared statements. Errors are Status, and name the file.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "server/store/row_source.h"

namespace lightmill::sqlite {

/// The Status of an SQLite error code: RESOURCE_EXHAUSTED for a full disk, UNAVAILABLE for I/O errors and locks,
/// DATA_LOSS for a damaged file, otherwise INTERNAL.
Status error_of(int code, sqlite3* database);

/// One prepared statement. Bound views must stay alive until the next reset. Not thread-safe.
class Statement final : public stored::Row {
 public:
  Statement() = default;
  explicit Statement(sqlite3_stmt* statement) : statement_(statement) {}
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(Statement&& other) noexcept : statement_(std::exchange(other.statement_, nullptr)) {}
  Statement& operator=(Statement&& other) noexcept {
    std::swap(statement_, other.statement_);
    return *this;
  }

  /// Binds the arguments to ?1, ?2, … in order. Unsigned 64-bit numbers keep their bits.
  template <class... Args>
  void bind_all(const Args&... args) {
    bind_from(1, args...);
  }
  /// Like bind_all(), from ?`index` on.
  template <class... Args>
  void bind_from(int index, const Args&... args) {
    (bind(index++, args), ...);
  }

  /// True if there is a row to read.
  Result<bool> step();
  /// Runs a statement to its end, and resets it. Calls `read` for each row.
  template <class Read>
  Status run(const Read& read) {
    Result<bool> more = step();
    for (; more.ok() && *more; more = step()) {
      read(*this);
    }
    reset();
    return more.status();
  }
  Status run() {
    return run([](const Statement&) {});
  }
  void reset();

  std::int64_t integer(int column) const override { return sqlite3_column_int64(statement_, column); }
  double real(int column) const override { return sqlite3_column_double(statement_, column); }
  std::string_view view(int column) const override;

 private:
  void bind(int index, std::int64_t value) { sqlite3_bind_int64(statement_, index, value); }
  void bind(int index, std::uint64_t value) { bind(index, static_cast<std::int64_t>(value)); }
  void bind(int index, std::int32_t value) { bind(index, std::int64_t{value}); }
  void bind(int index, std::uint32_t value) { bind(index, std::int64_t{value}); }
  void bind(int index, double value) { sqlite3_bind_double(statement_, index, value); }
  void bind(int index, std::string_view text) {
    sqlite3_bind_text64(statement_, index, text.data() == nullptr ? "" : text.data(), text.size(), SQLITE_STATIC,
                        SQLITE_UTF8);
  }
  void bind(int index, const std::string& text) { bind(index, std::string_view(text)); }
  void bind(int index, ByteView blob) {
    sqlite3_bind_blob64(statement_, index, blob.empty() ? "" : static_cast<const void*>(blob.data()), blob.size(),
                        SQLITE_STATIC);
  }

  sqlite3_stmt* statement_ = nullptr;
};

/// One connection. Not thread-safe.
class Database final : public stored::RowSource {
 public:
  Database() = default;
  explicit Database(sqlite3* handle) : handle_(handle) {}
  ~Database() { sqlite3_close_v2(handle_); }
  Database(Database&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Database& operator=(Database&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }

  /// Opens or creates the file.
  static Result<Database> open(const std::filesystem::path& path);

  Status for_each(const std::string& select, const std::function<void(const stored::Row&)>& read) override;
  Status execute(const std::string& sql) override;
  Result<Statement> prepare(std::string_view sql);
  std::string file() const { return sqlite3_db_filename(handle_, "main"); }
  /// The first column of the only row of `sql`.
  Result<std::int64_t> number(std::string_view sql);
  /// Whether closing writes the journal to the file, and deletes the journal.
  void checkpoint_at_close(bool wanted) const;
  bool in_transaction() const { return sqlite3_get_autocommit(handle_) == 0; }

 private:
  sqlite3* handle_ = nullptr;
};

/// Reads all pages. DATA_LOSS names the tables whose pages are damaged, and the jobs whose rows cannot be read.
Status check_structure(Database& database);

}  // namespace lightmill::sqlite
