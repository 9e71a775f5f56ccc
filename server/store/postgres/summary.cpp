#include "server/store/postgres/summary.h"

#include "server/store/row_values.h"

namespace lightmill::postgres {
namespace {

Status damaged(const Session& session, std::string_view what) {
  return data_loss("{}: {}", session.place(), what);
}

}  // namespace

std::int64_t checksum_of(const Summary& summary) {
  Xxh3Hasher hasher;
  const std::array<std::uint64_t, 3> numbers{summary.epoch, summary.commits, summary.highest_job};
  hasher.append(stored::view_of(numbers));
  hasher.append(as_byte_view(summary.sums.bytes()));
  return static_cast<std::int64_t>(hasher.finish().low);
}

Result<Summary> read_summary(Session& session) {
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT epoch, commits, highest_job, sums, checksum FROM summary"));
  Summary summary;
  if (rows.size() != 1) {
    return damaged(session, fmt::format("the table summary must have one row, got {}", rows.size()));
  }
  summary.epoch = rows.natural(0, 0);
  summary.commits = rows.natural(0, 1);
  summary.highest_job = rows.natural(0, 2);
  LM_ASSIGN_OR_RETURN(summary.sums, stored::RowSums::from_bytes(rows.view(0, 3)));
  return rows.integer(0, 4) == checksum_of(summary) ? Result<Summary>(summary)
                                                    : damaged(session, "the table summary has a wrong checksum");
}

Status check_current_epoch(Session& session, std::string_view table) {
  // One statement, so that no commit comes between the tables.
  const std::string sql = fmt::format(
      "SELECT {0}.epoch, {0}.commits, {0}.highest_job, summary.epoch, summary.commits, summary.highest_job FROM {0}, "
      "summary, lease, audit_secret",
      table);
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query(sql.c_str()));
  if (rows.size() != 1) {
    return damaged(session,
                   fmt::format("the tables {}, summary, lease and audit_secret must have one row each", table));
  }
  const std::uint64_t epoch = rows.natural(0, 0), commits = rows.natural(0, 1), written = rows.natural(0, 3);
  const bool agrees = epoch == written ? commits == rows.natural(0, 4) : epoch > written && commits == 0;
  return agrees && rows.natural(0, 2) == rows.natural(0, 5)
             ? ok_status()
             : damaged(session, fmt::format("the table {} is damaged: epoch {}, commit {}, highest job {}", table,
                                            epoch, commits, rows.natural(0, 2)));
}

Status create_summary(Session& session, const stored::RowSums& sums) {
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query("SELECT epoch, commits, highest_job FROM current_epoch"));
  if (rows.size() != 1) {
    return damaged(session, fmt::format("the table current_epoch must have one row, got {}", rows.size()));
  }
  const Summary summary{rows.natural(0, 0), rows.natural(0, 1), rows.natural(0, 2), sums};
  const std::string bytes = sums.bytes();
  return session
      .query("INSERT INTO summary VALUES ($1, $2, $3, $4, $5)",
             Parameters(summary.epoch, summary.commits, summary.highest_job, as_byte_view(bytes), checksum_of(summary)))
      .status();
}

}  // namespace lightmill::postgres
