#include "server/store/sqlite/structure.h"

#include <fmt/ranges.h>

#include <vector>

namespace lightmill::sqlite {
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
