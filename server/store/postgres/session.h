// PostgreSQL connection: binary parameters and rows, pipelines, time limits. Errors are Status.
#pragma once

#include <chrono>
#include <deque>
#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "server/store/postgres/values.h"

struct pg_conn;

namespace lightmill::postgres {

/// SQLSTATEs that the functions of our schema raise.
inline constexpr std::string_view kDeposed = "LM001";        ///< another epoch has begun
inline constexpr std::string_view kStoredAlready = "LM002";  ///< a transaction with this number is stored

struct Target {
  std::string url;          ///< postgres://…
  std::string application;  ///< name of the connection in the server's lists; at most 63 bytes

  /// "PostgreSQL at HOST:PORT, database NAME", without the password. INVALID_ARGUMENT if the URL is invalid.
  Result<std::string> describe() const;
};

/// One connection, made when it is needed and again after it was lost. Not thread-safe.
///
/// Errors: UNAVAILABLE if another attempt may help (no connection, a server that stops, a deadlock), RESOURCE_EXHAUSTED
/// for a full disk, PERMISSION_DENIED, DATA_LOSS for damage, otherwise INTERNAL. The message names the database.
class Session final : public stored::RowSource {
 public:
  /// Prepares `statements` for batches. A server that is silent for `timeout` during a call counts as dead.
  Session(Target target, std::span<const char* const> statements, std::chrono::milliseconds timeout);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Connects if there is no connection.
  Status connect();
  bool connected() const { return connection_ != nullptr; }
  void close();

  Status execute(const std::string& sql) override;
  Status for_each(const std::string& select, const std::function<void(const stored::Row&)>& read) override;
  Result<Rows> query(const char* sql, const Parameters& parameters);
  Result<Rows> query(const char* sql) { return query(sql, Parameters()); }

  /// A batch of prepared statements, sent without waiting for replies: begin, add …, finish. finish_batch() returns the
  /// errors of add(). Statements after a failed one do not run. After an error the batch is over, and its transaction
  /// is rolled back.
  Status begin_batch();
  void add(int statement, const Parameters& parameters);
  void add(int statement) { add(statement, Parameters()); }
  /// Waits for the replies up to here. Calls `read` for each row, with its statement.
  Status read_batch(const std::function<void(int statement, const stored::Row&)>& read);
  Status finish_batch();

  /// The SQLSTATE of the last failure; empty if the server gave none.
  const std::string& last_state() const { return last_state_; }
  const std::string& place() const { return place_; }

 private:
  Status set_up();
  Status send(const char* sql, const Parameters& parameters);
  Status end_batch(Status failure);
  /// Sends what waits, and passes on each result until the statement ends. Returns the first error.
  Status receive(const std::function<void(Rows)>& take);
  Status prepare_all();
  Status lost(std::string_view what);
  Status failure_of(const pg_result* result);
  /// Waits until everything is sent.
  Status flush();
  /// The next result. Null at the end of the current statement.
  Result<pg_result*> next_result();

  const Target target_;
  const std::span<const char* const> statements_;
  const std::chrono::milliseconds timeout_;
  std::string place_;
  pg_conn* connection_ = nullptr;
  std::string last_state_;
  Status batch_failure_;
  std::deque<int> unanswered_;  ///< statements of the batch
  std::size_t unsent_bytes_ = 0;
};

}  // namespace lightmill::postgres
