// A thin owner of a PostgreSQL connection: binary parameters and rows, pipelines, patience with an end, errors as
// Status.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"

struct pg_conn;
struct pg_result;

namespace lightmill::postgres {

/// SQLSTATEs that the functions of our schema raise.
inline constexpr std::string_view kDeposed = "LM001";        ///< the epoch is another one
inline constexpr std::string_view kStoredAlready = "LM002";  ///< a transaction of this number is stored

struct Target {
  std::string url;          ///< postgres://…
  std::string application;  ///< how the connection is called in the server's lists; at most 63 bytes

  /// "PostgreSQL at HOST:PORT, database NAME", without the password; INVALID_ARGUMENT if the URL is none.
  Result<std::string> describe() const;
};

/// The parameters $1, $2, … of one statement. What they view must outlive it.
class Parameters {
 public:
  template <class... Args>
  explicit Parameters(const Args&... args) {
    (add(args), ...);
  }
  Parameters(const Parameters&) = delete;
  Parameters& operator=(const Parameters&) = delete;

  int count() const { return count_; }
  const char* const* values() const { return values_.data(); }
  const int* lengths() const { return lengths_.data(); }
  /// All are sent in their binary form.
  const int* formats() const;
  std::size_t size_bytes() const { return size_bytes_; }

 private:
  static constexpr int kMost = 32;
  void add(std::int64_t value);
  void add(std::uint64_t value) { add(static_cast<std::int64_t>(value)); }  // keeps its bits
  void add(std::int32_t value) { add(std::int64_t{value}); }
  void add(std::uint32_t value) { add(std::int64_t{value}); }
  void add(double value);
  /// PostgreSQL's texts have neither zeros nor what is not UTF-8: such bytes are written out as printable() does.
  void add(std::string_view text);
  void add(const std::string& text) { add(std::string_view(text)); }
  void add(const char* text) { add(std::string_view(text)); }
  void add(ByteView bytes);
  void add_raw(const char* bytes, std::size_t size);

  int count_ = 0;
  std::size_t size_bytes_ = 0;
  std::array<std::uint64_t, kMost> numbers_;
  std::array<const char*, kMost> values_;
  std::array<int, kMost> lengths_;
  std::deque<std::string> texts_;
};

/// What a query gave, in binary: BIGINT, DOUBLE PRECISION, BOOLEAN, TEXT and BYTEA columns without NULL.
class Rows {
 public:
  explicit Rows(pg_result* result) : result_(result) {}
  ~Rows();
  Rows(Rows&& other) noexcept : result_(std::exchange(other.result_, nullptr)) {}
  Rows& operator=(Rows&& other) noexcept {
    std::swap(result_, other.result_);
    return *this;
  }

  int size() const;
  std::int64_t integer(int row, int column) const { return static_cast<std::int64_t>(natural(row, column)); }
  std::uint64_t natural(int row, int column) const;
  double real(int row, int column) const;
  bool flag(int row, int column) const;
  std::string text(int row, int column) const { return std::string(view(row, column)); }
  /// Valid while the rows live.
  std::string_view view(int row, int column) const;

 private:
  pg_result* result_;
};

/// One connection that is made when it is needed, and made again when it was lost. Not thread-safe.
///
/// Errors: UNAVAILABLE where trying again may help (no connection, a server that stops, a deadlock), RESOURCE_EXHAUSTED
/// for a full disk, PERMISSION_DENIED, DATA_LOSS for damage, INTERNAL for the rest; the message names the database.
class Session {
 public:
  /// `statements` are prepared for batches. A server that is silent for `patience` while something is asked of it is
  /// taken for dead.
  Session(Target target, std::span<const char* const> statements, std::chrono::milliseconds patience);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Connects unless it stands.
  Status connect();
  bool connected() const { return connection_ != nullptr; }
  void close();

  /// Statements without parameters whose rows do not matter.
  Status execute(const std::string& sql);
  Result<Rows> query(const char* sql, const Parameters& parameters);
  Result<Rows> query(const char* sql) { return query(sql, Parameters()); }

  /// A batch of prepared statements, sent without waiting for the answers: begin, add …, finish. Errors of add() come
  /// out of finish(). Statements after a failing one are not run.
  Status begin_batch();
  void add(int statement, const Parameters& parameters);
  void add(int statement) { add(statement, Parameters()); }
  Status finish_batch();

  /// The SQLSTATE of the last failure; empty if the server gave none.
  const std::string& last_state() const { return last_state_; }
  const std::string& place() const { return place_; }

 private:
  Status set_up();
  Status prepare_all();
  Status lost(std::string_view what);
  Status failure_of(const pg_result* result);
  /// Waits until all is sent.
  Status flush();
  /// The next result; null when there is no more of the current statement.
  Result<pg_result*> next_result();

  const Target target_;
  const std::span<const char* const> statements_;
  const std::chrono::milliseconds patience_;
  std::string place_;
  pg_conn* connection_ = nullptr;
  std::string last_state_;
  Status batch_failure_;
  std::size_t unsent_bytes_ = 0;
};

}  // namespace lightmill::postgres
