#include "server/store/postgres/format_7.h"

#include "common/base/log.h"
#include "server/store/postgres/schema.h"
#include "server/store/postgres/summary.h"

namespace lightmill::postgres {
namespace {

Status upgrade(Session& session) {
  LM_RETURN_IF_ERROR(session.execute("BEGIN; SELECT pg_advisory_xact_lock(x'4c4d494c'::int)"));
  LM_ASSIGN_OR_RETURN(const Rows format, session.query("SELECT format FROM meta"));
  if (format.size() != 1 || format.integer(0, 0) != kFormat7) {
    return session.execute("ROLLBACK");  // another coordinator has done it
  }
  LM_RETURN_IF_ERROR(check_idle(session));
  LM_ASSIGN_OR_RETURN(const stored::RowKeys keys, load_keys(session));
  LM_RETURN_IF_ERROR(session.execute(kSummaryTable));
  LM_RETURN_IF_ERROR(create_summary(session, keys.sums()));
  return session.execute(fmt::format("UPDATE meta SET format = {}; COMMIT", kFormat));
}

}  // namespace

Status check_idle(Session& session) {
  LM_ASSIGN_OR_RETURN(const Rows lease, session.query("SELECT expires > clock_timestamp(), holder FROM lease"));
  return lease.size() == 1 && lease.flag(0, 0)
             ? failed_precondition("{}: a coordinator of the previous version uses it ({}): stop that one first",
                                   session.place(), lease.text(0, 1))
             : ok_status();
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
