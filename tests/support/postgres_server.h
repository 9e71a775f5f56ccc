// A PostgreSQL server of a test's own, in a temporary folder and reached by a socket there.
#pragma once

#include <memory>
#include <string>

#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// Runs as the user `postgres` where the test runs as root, which PostgreSQL refuses. Nothing of it outlives its owner.
class PostgresServer {
 public:
  PostgresServer();
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  /// Starts it again; it was stopped.
  void start();
  /// At once, as a crash does; what it has promised to keep is kept.
  void stop();

  /// The URL of a new, empty database, whose owner is no superuser.
  std::string new_database(const std::string& encoding = "UTF8");
  /// The URL of the same database over TCP at 127.0.0.1.
  static std::string over_tcp(const std::string& url, int port);
  std::string socket_file() const;
  /// A new database with all that the one of the URL holds at this moment, by pg_dump and pg_restore; its URL.
  std::string dumped_and_restored(const std::string& url);

 private:
  std::string url(const std::string& user, const std::string& database) const;

  TemporaryFolder folder_;
  std::unique_ptr<BackgroundProcess> process_;
  int databases_ = 0;
};

/// Runs statements in the database of the URL; the test fails if they do. The first value of the last row, as text.
std::string run_sql(const std::string& url, const std::string& sql);

}  // namespace lightmill::test
