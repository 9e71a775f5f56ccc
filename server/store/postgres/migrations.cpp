#include "server/store/postgres/migrations.h"

#include "common/base/log.h"
#include "server/store/load_state.h"
#include "server/store/migration.h"
#include "server/store/old_rows.h"
#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/schema.h"
#include "server/store/postgres/summary.h"

namespace lightmill::postgres {
namespace {

/// Name of the table `current_epoch` up to format 9.
constexpr std::string_view kOldEpochTable = "turn";
/// Since this format, the summary has sums over all rows. Format 8 has sums over the keys of small rows.
constexpr int kRowSumsFormat = 9;

/// Reads all but nodes, which the database copies itself.
Result<StoredState> load_format_6(Session& session) {
  StoredState state;
  LM_RETURN_IF_ERROR(stored::load_old_rows(session, state));
  LM_ASSIGN_OR_RETURN(const Rows highest, session.query("SELECT highest_job FROM turn"));
  state.next_job_id = highest.natural(0, 0) + 1;
  return state;
}

/// A store that writes in the caller's transaction.
class InTransaction final : public Store {
 public:
  explicit InTransaction(Session& session) : session_(session) {}
  Result<StoredState> load() override { return internal_error("a store that is being created cannot be read"); }
  Result<FilmPiece> read_film(JobId, const FilmPosition&) override { return load().status(); }
  Status check_structure() override { return ok_status(); }
  Status commit(std::span<const StoreOp> ops) override {
    LM_RETURN_IF_ERROR(send_writes(session_, ops, specs_));
    specs_.keep();
    return ok_status();
  }

 private:
  Session& session_;
  stored::StoredSpecs specs_;
};

constexpr const char* kBeginMigration = "BEGIN; SELECT pg_advisory_xact_lock(x'4c4d494c'::int)";
/// Copies rows from format 6 that this program does not read.
constexpr const char* kCopyFormat6 = R"sql(
UPDATE current_epoch SET epoch = before.epoch, highest_job = before.highest_job FROM lightmill_format_6.turn AS before;
DELETE FROM audit_secret;
INSERT INTO audit_secret SELECT secret, sha256(secret) FROM lightmill_format_6.verification_secret;
INSERT INTO nodes SELECT * FROM lightmill_format_6.nodes WHERE job IN (SELECT id FROM jobs);
)sql";
/// Copies all rows from the schema {0}.
constexpr const char* kCopySameRows = R"sql(
UPDATE current_epoch SET epoch = before.epoch, commits = before.commits, highest_job = before.highest_job
  FROM {0}.turn AS before;
DELETE FROM audit_secret;
INSERT INTO audit_secret SELECT * FROM {0}.audit_secret;
INSERT INTO jobs SELECT * FROM {0}.jobs;
INSERT INTO job_specs SELECT * FROM {0}.job_specs;
INSERT INTO job_progress SELECT * FROM {0}.job_progress;
INSERT INTO nodes SELECT * FROM {0}.nodes;
INSERT INTO results SELECT * FROM {0}.results;
INSERT INTO tokens SELECT * FROM {0}.tokens;
INSERT INTO actions SELECT * FROM {0}.actions;
INSERT INTO quarantine SELECT * FROM {0}.quarantine;
)sql";

std::string kept_schema(int format) {
  return fmt::format("lightmill_format_{}", format);
}

/// Keeps the schema under another name, and creates the tables of this format.
Status replace_schema(Session& session, int format) {
  LM_RETURN_IF_ERROR(session.execute(
      fmt::format("ALTER SCHEMA lightmill RENAME TO {}; CREATE SCHEMA lightmill", kept_schema(format))));
  LM_RETURN_IF_ERROR(session.execute(kSchema));
  return session.execute(kSummaryTable);
}

Status copy_assets(Session& session, int format) {
  return session.execute(fmt::format(
      "INSERT INTO assets OVERRIDING SYSTEM VALUE SELECT * FROM {0}.assets;"
      "INSERT INTO asset_pieces SELECT * FROM {0}.asset_pieces;"
      "SELECT setval(pg_get_serial_sequence('assets', 'id'), (SELECT coalesce(max(id), 0) + 1 FROM assets))",
      kept_schema(format)));
}

Status check_idle(Session& session) {
  LM_ASSIGN_OR_RETURN(const Rows lease, session.query("SELECT expires > clock_timestamp(), holder FROM lease"));
  return lease.size() == 1 && lease.flag(0, 0)
             ? failed_precondition("{}: a coordinator of the previous version uses it ({}): stop that one first",
                                   session.place(), lease.text(0, 1))
             : ok_status();
}

Status fill_from_format_6(Session& session) {
  LM_ASSIGN_OR_RETURN(const StoredState state, load_format_6(session));
  LM_RETURN_IF_ERROR(replace_schema(session, kOldestFormat));
  InTransaction store(session);
  LM_RETURN_IF_ERROR(write_state(state, store));
  return session.execute(kCopyFormat6);
}

/// Small rows of format 8.
Status check_key_sums(Session& session) {
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query("SELECT keys FROM summary"));
  return stored::check_old_sums(session, rows.view(0, 0));
}

/// Small rows since kRowSumsFormat.
Status check_row_sums(Session& session) {
  LM_ASSIGN_OR_RETURN(const Summary written, read_summary(session));
  LM_ASSIGN_OR_RETURN(const stored::RowSums found, stored::load_sums(session));
  return found.check_tables(written.sums);
}

/// Compares the rows with the summary, which format 7 does not have.
Status check_rows(Session& session, int format) {
  LM_RETURN_IF_ERROR(check_current_epoch(session, kOldEpochTable));
  const Status complete = format < kRowSumsFormat ? check_key_sums(session) : check_row_sums(session);
  return complete.code() != StatusCode::kFailedPrecondition
             ? complete
             : failed_precondition(
                   "{}: {}. Restore a backup, or start the lightmill-server that wrote it once with --accept-loss",
                   session.place(), message_of(complete));
}

Status fill_from_same_rows(Session& session, int format) {
  LM_RETURN_IF_ERROR(format == kSameRowsFormat ? ok_status() : check_rows(session, format));
  LM_RETURN_IF_ERROR(replace_schema(session, format));
  return session.execute(fmt::format(kCopySameRows, kept_schema(format)));
}

Status fill(Session& session, int format) {
  LM_RETURN_IF_ERROR(format == kOldestFormat ? fill_from_format_6(session) : fill_from_same_rows(session, format));
  LM_RETURN_IF_ERROR(copy_assets(session, format));
  if (format >= kRowSumsFormat) {  // the sums show which tiles are damaged, so they stay
    return session.execute(fmt::format("INSERT INTO summary SELECT * FROM {}.summary", kept_schema(format)));
  }
  LM_ASSIGN_OR_RETURN(const stored::RowSums sums, stored::load_sums(session));
  return create_summary(session, sums);
}

Status migrate_from(int format, Session& session) {
  LM_RETURN_IF_ERROR(session.execute(kBeginMigration));
  LM_ASSIGN_OR_RETURN(const Rows found, session.query("SELECT format FROM meta"));
  if (found.size() != 1 || found.integer(0, 0) != format) {
    return session.execute("ROLLBACK");  // another coordinator has migrated it
  }
  LM_RETURN_IF_ERROR(check_idle(session));
  spdlog::info("{} has store format {}. Converting its tables to format {}", session.place(), format, kFormat);
  LM_RETURN_IF_ERROR(fill(session, format));
  LM_RETURN_IF_ERROR(session.execute("COMMIT"));
  spdlog::info(
      "the tables of format {0} are kept in the schema {1}, in case you return to an older lightmill-server. DROP "
      "SCHEMA {1} CASCADE frees their space",
      format, kept_schema(format));
  return ok_status();
}

/// Explains a missing table or column: the format's number is damaged, or the tables are.
Status explain(const Status& status, const Session& session, int format) {
  const bool is_missing = session.last_state() == "42P01" || session.last_state() == "42703";
  return is_missing
             ? data_loss("{}. The table meta says format {}. This number or the tables are damaged. Restore a backup",
                         message_of(status), format)
             : status;
}

}  // namespace

Status migrate(Session& session, int format) {
  Status status = migrate_from(format, session);
  if (!status.ok()) {
    status = explain(status, session, format);
    session.close();  // this ends the transaction
  }
  return status;
}

}  // namespace lightmill::postgres
