#include "tests/support/postgres_server.h"

#include <gtest/gtest.h>
#include <libpq-fe.h>
#include <pwd.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/file.h"

namespace lightmill::test {
namespace {

namespace fs = std::filesystem;

/// Folder of the newest PostgreSQL's programs on Debian.
fs::path programs() {
  std::vector<fs::path> found;
  std::error_code none;
  for (const auto& version : fs::directory_iterator("/usr/lib/postgresql", none)) {
    if (fs::exists(version.path() / "bin" / "initdb")) {
      found.push_back(version.path() / "bin");
    }
  }
  LM_CHECK(!found.empty(), "PostgreSQL is not installed: deploy/setup --tests");
  return *std::max_element(found.begin(), found.end());
}

/// `command`, run as the user postgres if this process is root.
std::vector<std::string> unprivileged(std::vector<std::string> command) {
  if (::geteuid() == 0) {
    const std::vector<std::string> as{"/usr/bin/setpriv", "--reuid=postgres", "--regid=postgres",
                                      "--clear-groups",   "--pdeathsig=KILL", "--"};
    command.insert(command.begin(), as.begin(), as.end());
  }
  return command;
}

}  // namespace

PostgresServer::PostgresServer() {
  if (::geteuid() == 0) {
    const passwd* user = ::getpwnam("postgres");
    LM_CHECK(user != nullptr, "there is no user postgres: deploy/setup --tests");
    LM_CHECK(::chown(folder_.path().c_str(), user->pw_uid, user->pw_gid) == 0);
  }
  const CommandResult made =
      run_command(unprivileged({(programs() / "initdb").string(), "-D", (folder_.path() / "data").string(), "-U",
                                "postgres", "-A", "trust", "-E", "UTF8", "--no-locale", "--no-sync"}));
  LM_CHECK(made.exit_code == 0, "initdb: {}{}", made.out, made.err);
  start();
  run_sql(url("postgres", "postgres"), "CREATE ROLE lightmill LOGIN");
}

PostgresServer::~PostgresServer() {
  stop();
}

void PostgresServer::start() {
  // These tests do not cover a crash of the machine, and its guarantee is slow. Shared memory in files of the data folder
  // goes with it, also after a kill.
  process_ = std::make_unique<BackgroundProcess>(
      unprivileged({(programs() / "postgres").string(), "-D", (folder_.path() / "data").string(), "-c",
                    "listen_addresses=", "-c", "unix_socket_directories=" + folder_.path().string(), "-c", "fsync=off",
                    "-c", "dynamic_shared_memory_type=mmap", "-c", "max_connections=50", "-c", "shared_buffers=32MB"}),
      (folder_.path() / "log").string());
  const bool up = eventually([&] { return PQping(url("postgres", "postgres").c_str()) == PQPING_OK; });
  LM_CHECK(up, "PostgreSQL does not start: {}", read_file(folder_.path() / "log").value());
}

void PostgresServer::stop() {
  process_->send(SIGQUIT);
  process_->wait();
}

std::string PostgresServer::url(const std::string& user, const std::string& database) const {
  return fmt::format("postgres://{}@/{}?host={}", user, database, folder_.path().string());
}

std::string PostgresServer::over_tcp(const std::string& url, int port) {
  return fmt::format("postgres://lightmill@127.0.0.1:{}{}", port,
                     url.substr(url.find("@") + 1, url.find('?') - url.find('@') - 1));
}

std::string PostgresServer::dumped_and_restored(const std::string& url) {
  const std::string dump = (folder_.path() / fmt::format("dump{}", databases_)).string();
  const CommandResult dumped =
      run_command({(programs() / "pg_dump").string(), "--format=custom", "--file=" + dump, url});
  EXPECT_EQ(dumped.exit_code, 0) << dumped.err;
  const std::string restored = new_database();
  const CommandResult put_back =
      run_command({(programs() / "pg_restore").string(), "--exit-on-error", "--dbname=" + restored, dump});
  EXPECT_EQ(put_back.exit_code, 0) << put_back.err;
  return restored;
}

std::string PostgresServer::socket_file() const {
  return (folder_.path() / ".s.PGSQL.5432").string();
}

std::string PostgresServer::new_database(const std::string& encoding) {
  const std::string name = fmt::format("farm{}", ++databases_);
  run_sql(url("postgres", "postgres"),
          fmt::format("CREATE DATABASE {} OWNER lightmill ENCODING '{}' TEMPLATE template0", name, encoding));
  return url("lightmill", name);
}

std::string run_sql(const std::string& url, const std::string& sql) {
  PGconn* connection = PQconnectdb(url.c_str());
  PGresult* result = PQexec(connection, sql.c_str());
  const ExecStatusType status = PQresultStatus(result);
  EXPECT_TRUE(status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) << sql << ": " << PQerrorMessage(connection);
  const std::string value = PQntuples(result) > 0 ? PQgetvalue(result, PQntuples(result) - 1, 0) : "";
  PQclear(result);
  PQfinish(connection);
  return value;
}

}  // namespace lightmill::test
