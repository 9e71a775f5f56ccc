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
    LM_RETURN_IF_ERROR(send_writes(session_, ops, specs_, keys_));
    specs_.keep();
    keys_.keep();
    return ok_status();
  }
  const stored::RowKeys& keys() const { return keys_; }

 private:
  Session& session_;
  stored::StoredSpecs specs_;
  stored::RowKeys keys_;
};

constexpr const char* kBeginMigration = "BEGIN; SELECT pg_advisory_xact_lock(x'4c4d494c'::int)";
constexpr const char* kMove = "ALTER SCHEMA lightmill RENAME TO lightmill_format_6; CREATE SCHEMA lightmill";
constexpr const char* kCopy = R"sql(
UPDATE turn SET epoch = before.epoch, highest_job = before.highest_job FROM lightmill_format_6.turn AS before;
DELETE FROM audit_secret;
INSERT INTO audit_secret SELECT secret, sha256(secret) FROM lightmill_format_6.verification_secret;
INSERT INTO assets OVERRIDING SYSTEM VALUE SELECT * FROM lightmill_format_6.assets;
INSERT INTO asset_pieces SELECT * FROM lightmill_format_6.asset_pieces;
SELECT setval(pg_get_serial_sequence('assets', 'id'), (SELECT coalesce(max(id), 0) + 1 FROM assets));
INSERT INTO nodes SELECT * FROM lightmill_format_6.nodes WHERE job IN (SELECT id FROM jobs);
)sql";

Status check_idle(Session& session) {
  LM_ASSIGN_OR_RETURN(const Rows lease, session.query("SELECT expires > clock_timestamp(), holder FROM lease"));
  return lease.size() == 1 && lease.flag(0, 0)
             ? failed_precondition("{}: a coordinator of the previous version uses it ({}): stop that one first",
                                   session.place(), lease.text(0, 1))
             : ok_status();
}

Status migrate(Session& session) {
  LM_RETURN_IF_ERROR(session.execute(kBeginMigration));
  LM_ASSIGN_OR_RETURN(const Rows format, session.query("SELECT format FROM meta"));
  if (format.integer(0, 0) != kFormatBefore) {
    return session.execute("ROLLBACK");  // another coordinator has migrated it
  }
  LM_RETURN_IF_ERROR(check_idle(session));
  LM_ASSIGN_OR_RETURN(const StoredState state, load_format_6(session));
  LM_RETURN_IF_ERROR(session.execute(kMove));
  LM_RETURN_IF_ERROR(session.execute(kSchema));
  LM_RETURN_IF_ERROR(session.execute(kSummaryTable));
  InTransaction store(session);
  LM_RETURN_IF_ERROR(write_state(state, store));
  LM_RETURN_IF_ERROR(session.execute(kCopy));
  LM_RETURN_IF_ERROR(create_summary(session, store.keys().sums()));
  return session.execute("COMMIT");
}

Status upgrade(Session& session) {
  LM_RETURN_IF_ERROR(session.execute(kBeginMigration));
  LM_ASSIGN_OR_RETURN(const Rows format, session.query("SELECT format FROM meta"));
  if (format.size() != 1 || format.integer(0, 0) != kFormat7) {
    return session.execute("ROLLBACK");  // another coordinator has done it
  }
  LM_RETURN_IF_ERROR(check_idle(session));
  LM_ASSIGN_OR_RETURN(const stored::RowKeys keys, stored::load_keys(session));
  LM_RETURN_IF_ERROR(session.execute(kSummaryTable));
  LM_RETURN_IF_ERROR(create_summary(session, keys.sums()));
  return session.execute(fmt::format("UPDATE meta SET format = {}; COMMIT", kFormat));
}

}  // namespace

Status migrate_from_format_6(Session& session) {
  spdlog::info("{} has store format {}; converting its tables to format {}", session.place(), kFormatBefore, kFormat);
  if (const Status status = migrate(session); !status.ok()) {
    session.close();  // this ends the transaction
    return status;
  }
  spdlog::info(
      "the tables of format {} are kept in the schema lightmill_format_6, in case you return to an older "
      "lightmill-server. DROP SCHEMA lightmill_format_6 CASCADE frees their space",
      kFormatBefore);
  return ok_status();
}

Status upgrade_from_format_7(Session& session) {
  const Status status = upgrade(session);
  if (!status.ok()) {
    session.close();  // this ends the transaction
    return status;
  }
  spdlog::info("{} had store format {}; it has format {} now", session.place(), kFormat7, kFormat);
  return status;
}

}  // namespace lightmill::postgres
