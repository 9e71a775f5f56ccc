// A PostgreSQL server for one test, in a temporary folder and reached by a socket there.
#pragma once

#include <memory>
#include <string>

#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// Runs as the user `postgres` when the test runs as root, because PostgreSQL refuses root. Its processes and files end
/// with it.
class PostgresServer {
 public:
  PostgresServer();
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  /// Starts the stopped server again.
  void start();
  /// Stops it at once, like a crash. Committed data stays.
  void stop();

  /// The URL of a new, empty database. Its owner is no superuser.
  std::string new_database(const std::string& encoding = "UTF8");
  /// The URL of the same database over TCP at 127.0.0.1.
  static std::string over_tcp(const std::string& url, int port);
  std::string socket_file() const;
  /// Copies a database with pg_dump and pg_restore, and returns the URL of the copy.
  std::string dumped_and_restored(const std::string& url);

 private:
  std::string url(const std::string& user, const std::string& database) const;

  TemporaryFolder folder_;
  std::unique_ptr<BackgroundProcess> process_;
  int databases_ = 0;
};

/// Runs statements in the database, and returns the first value of the last row as text. Fails the test on an error.
std::string run_sql(const std::string& url, const std::string& sql);

}  // namespace lightmill::test
