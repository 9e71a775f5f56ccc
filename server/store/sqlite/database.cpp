#include "server/store/sqlite/database.h"

#include <fmt/ranges.h>

#include <vector>

namespace lightmill::sqlite {

Status error_of(int code, sqlite3* database) {
  StatusCode status = StatusCode::kInternal;
  switch (code & 0xff) {
    case SQLITE_FULL:
      status = StatusCode::kResourceExhausted;
      break;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
      status = StatusCode::kUnavailable;
      break;
    case SQLITE_ERROR:  // the statements are ours: a table or column is missing
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      status = StatusCode::kDataLoss;
      break;
    default:
      break;
  }
  const char* file = database != nullptr ? sqlite3_db_filename(database, "main") : nullptr;
  const char* message = database != nullptr ? sqlite3_errmsg(database) : sqlite3_errstr(code);
  return make_error(status, "{}: {}{} (SQLite code {})", file != nullptr ? file : "database",
                    (code & 0xff) == SQLITE_CORRUPT ? "a page of the database is damaged: " : "", message, code);
}

Result<bool> Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) {
    return true;
  }
  if (code == SQLITE_DONE) {
    return false;
  }
  return error_of(code, sqlite3_db_handle(statement_));
}

void Statement::reset() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

std::string_view Statement::view(int column) const {
  const void* bytes = sqlite3_column_blob(statement_, column);
  const int size_bytes = sqlite3_column_bytes(statement_, column);
  return bytes == nullptr ? std::string_view()
                          : std::string_view(static_cast<const char*>(bytes), static_cast<std::size_t>(size_bytes));
}

Result<Database> Database::open(const std::filesystem::path& path) {
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(path.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database(handle);
  if (code != SQLITE_OK) {
    return make_error(StatusCode::kUnavailable, "cannot open {}: {}", path.string(), sqlite3_errstr(code));
  }
  sqlite3_extended_result_codes(handle, 1);
  return database;
}

Status Database::execute(const std::string& sql) {
  const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? ok_status() : error_of(code, handle_);
}

Status Database::for_each(const std::string& select, const std::function<void(const stored::Row&)>& read) {
  LM_ASSIGN_OR_RETURN(Statement rows, prepare(select));
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      return ok_status();
    }
    read(rows);
  }
}

Result<Statement> Database::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(handle_, sql.data(), static_cast<int>(sql.size()), SQLITE_PREPARE_PERSISTENT,
                                      &statement, nullptr);
  if (code != SQLITE_OK) {
    return error_of(code, handle_);
  }
  return Statement(statement);
}

Result<std::int64_t> Database::number(std::string_view sql) {
  LM_ASSIGN_OR_RETURN(Statement statement, prepare(sql));
  LM_ASSIGN_OR_RETURN(const bool row, statement.step());
  if (!row) {
    return data_loss("no row from {}", sql);
  }
  return statement.integer(0);
}

void Database::checkpoint_at_close(bool wanted) const {
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, wanted ? 0 : 1, nullptr);
}

// ---- pages ----

namespace {

Result<std::vector<std::string>> texts(Database& database, const std::string& select) {
  std::vector<std::string> found;
  LM_RETURN_IF_ERROR(database.for_each(select, [&](const stored::Row& row) { found.push_back(row.text(0)); }));
  return found;
}

bool is_whole(Database& database, const std::string& table) {
  const Result<std::vector<std::string>> found = texts(database, fmt::format("PRAGMA integrity_check('{}')", table));
  return found.ok() && *found == std::vector<std::string>{"ok"};
}

/// "nodes (jobs 2, 5)". Without jobs if the table has rows of none, or if all that can be read are whole.
std::string describe(Database& database, const std::string& table) {
  std::vector<std::string> jobs;
  if (table == "nodes" || table == "results") {
    jobs = texts(database, "SELECT id FROM jobs ORDER BY id").value_or(std::vector<std::string>());
  }
  std::erase_if(jobs, [&](const std::string& job) {
    return database.for_each(fmt::format("SELECT * FROM {} WHERE job = {}", table, job), [](const stored::Row&) {})
        .ok();
  });
  return jobs.empty() ? table
                      : fmt::format("{} ({} {})", table, jobs.size() == 1 ? "job" : "jobs", fmt::join(jobs, ", "));
}

}  // namespace

Status check_structure(Database& database) {
  LM_ASSIGN_OR_RETURN(const std::vector<std::string> found, texts(database, "PRAGMA integrity_check(1)"));
  if (found == std::vector<std::string>{"ok"}) {
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(std::vector<std::string> tables,
                      texts(database, "SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name"));
  std::erase_if(tables, [&](const std::string& table) { return is_whole(database, table); });
  for (std::string& table : tables) {
    table = describe(database, table);
  }
  const std::string why = fmt::format("{}", fmt::join(found, "; "));  // below a headline
  return data_loss("pages of the database are damaged{}{} (SQLite: {})",
                   tables.empty()       ? ""
                   : tables.size() == 1 ? ", in the table "
                                        : ", in the tables ",
                   fmt::join(tables, ", "), why.substr(why.rfind('\n') + 1));
}

}  // namespace lightmill::sqlite
