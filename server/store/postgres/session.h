// A thin owner of a PostgreSQL connection: binary parameters and rows, pipelines, patience with an end, errors as
// Status.
#pragma once

#include <chrono>
#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "server/store/postgres/values.h"

struct pg_conn;

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
