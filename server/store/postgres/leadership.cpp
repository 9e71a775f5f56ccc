#include "server/store/postgres/leadership.h"

#include <unistd.h>

#include <algorithm>
#include <random>

#include "common/base/address.h"
#include "common/base/log.h"
#include "server/store/migration.h"
#include "server/store/postgres/migrations.h"
#include "server/store/postgres/schema.h"
#include "server/store/postgres/summary.h"

namespace lightmill::postgres {
namespace {

/// Time limit of calls for the lease. At worst, a lease expires meanwhile.
constexpr auto kLeaseCallTimeout = std::chrono::milliseconds(2'000);
/// Time limit of a statement that copies all pixels.
constexpr auto kMigrationTimeout = std::chrono::hours(6);
/// Pause between two checks of a standby coordinator.
constexpr auto kCheckPause = std::chrono::milliseconds(300);
/// A coordinator is gone if it has no connection in this number of checks in a row. In fewer checks, the database may
/// have a short outage.
constexpr int kChecksUntilGone = 4;

std::string random_instance() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

/// Number of a commit across epochs. Increases with epoch and commit.
std::uint64_t mark_of(std::uint64_t epoch, std::uint64_t commits) {
  return epoch << 32 | commits;
}

/// "HOST, process N", for people.
std::string own_name() {
  return fmt::format("{}, process {}", host_name(), ::getpid());
}

/// Creates the tables in an empty database, unless `read_only`. Refuses tables of an unknown format. Sets `format` of
/// the tables.
Status check_tables(Session& session, bool read_only, std::int64_t& format) {
  LM_ASSIGN_OR_RETURN(const Rows there,
                      session.query("SELECT to_regnamespace('lightmill') IS NOT NULL, to_regclass('lightmill.meta') IS "
                                    "NOT NULL, EXISTS (SELECT FROM pg_class WHERE relnamespace = "
                                    "to_regnamespace('lightmill'))"));
  const bool has_schema = there.flag(0, 0), has_meta = there.flag(0, 1), has_others = there.flag(0, 2);
  if (!has_meta && has_others) {
    return failed_precondition(
        "{}: the schema 'lightmill' does not belong to a Lightmill store: choose another database with --store",
        session.place());
  }
  if (!has_meta && read_only) {
    return not_found("there is no farm in {}: name its database with --store", session.place());
  }
  if (!has_schema) {
    LM_RETURN_IF_ERROR(session.execute("CREATE SCHEMA lightmill"));
  }
  if (!has_meta) {
    LM_RETURN_IF_ERROR(session.execute(kSchema));
    LM_RETURN_IF_ERROR(session.execute(kSummaryTable));
    return create_summary(session, stored::RowSums());
  }
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query("SELECT format FROM meta"));
  format = rows.size() == 1 ? rows.integer(0, 0) : 0;
  return format >= kOldestFormat && format < kFormat
             ? ok_status()
             : check_store_format(session.place(), format, kFormat, "another database with --store");
}

/// Coordinators that start together run this one at a time.
Status prepare_tables(Session& session, const Target& target, bool read_only) {
  LM_RETURN_IF_ERROR(session.execute("BEGIN; SELECT pg_advisory_xact_lock(x'4c4d494c'::int);"));
  std::int64_t format = kFormat;
  const Status status = check_tables(session, read_only, format);
  if (!session.connected()) {
    return status;
  }
  const Status ended = session.execute(status.ok() ? "COMMIT" : "ROLLBACK");
  LM_RETURN_IF_ERROR(status.ok() ? ended : status);
  if (format == kFormat) {
    return ok_status();
  }
  Session migration(target, {}, kMigrationTimeout);
  return migrate(migration, static_cast<int>(format));
}

}  // namespace

Leadership::Leadership(Options options)
    : options_(std::move(options)), instance_(random_instance()), session_(target(), {}, kLeaseCallTimeout) {}

Target Leadership::target() const {
  return {options_.url, "lightmill-server " + instance_};
}

Result<std::unique_ptr<Leadership>> Leadership::take(Options options) {
  std::unique_ptr<Leadership> leadership(new Leadership(std::move(options)));
  LM_RETURN_IF_ERROR(leadership->target().describe().status());
  LM_RETURN_IF_ERROR(prepare_tables(leadership->session_, leadership->target(), leadership->options_.read_only));
  if (!leadership->options_.chain.empty()) {
    LM_ASSIGN_OR_RETURN(leadership->chain_, CommitChain::open(leadership->options_.chain));
  }
  LM_RETURN_IF_ERROR(leadership->stand_by());
  leadership->renewing_ = std::thread([raw = leadership.get()] { raw->keep_renewing(); });
  return leadership;
}

Leadership::~Leadership() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (renewing_.joinable()) {
    renewing_.join();
  }
  if (epoch_ > 0 && session_.connected()) {
    (void)session_.query("UPDATE lease SET expires = '-infinity' WHERE instance = $1", Parameters(instance_)).status();
  }
}

// ---- the lease ----

Result<std::string> Leadership::try_to_take(Session& session) {
  const double seconds = std::chrono::duration<double>(options_.lease).count();
  LM_ASSIGN_OR_RETURN(const Rows taken, session.query("SELECT new_epoch, held_by FROM take_lease($1, $2, $3)",
                                                      Parameters(instance_, own_name(), seconds)));
  if (taken.integer(0, 0) == 0) {
    return taken.text(0, 1);
  }
  epoch_ = taken.natural(0, 0);
  return std::string();
}

Status Leadership::stand_by() {
  std::string reported;
  for (bool first = true;; first = false) {
    // The same outage may have kept the active coordinator from renewing its lease, so it gets time to do so.
    if (!first && !session_.connected() && session_.connect().ok() && !options_.wait(options_.lease)) {
      return cancelled("stopped on standby");
    }
    Status whole = check_current_epoch(session_);
    whole = whole.ok() ? verify_chain(session_) : whole;
    whole = whole.ok() ? end_lease_of_gone(session_) : whole;
    const Result<std::string> holder = whole.ok() ? try_to_take(session_) : Result<std::string>(whole);
    if (holder.ok() && holder->empty()) {
      return ok_status();
    }
    if (holder.ok() && options_.read_only) {
      return failed_precondition("{}: a coordinator uses it ({}): stop that one first", session_.place(), *holder);
    }
    if (!holder.ok() && (first || holder.status().code() != StatusCode::kUnavailable)) {
      return holder.status();
    }
    const std::string news =
        holder.ok()
            ? fmt::format(
                  "on standby: {} is active on {}. This coordinator takes over when that one is silent for {:g} s",
                  *holder, session_.place(), std::chrono::duration<double>(options_.lease).count())
            : fmt::format("on standby, but {}", message_of(holder.status()));
    if (news != reported) {
      spdlog::info("{}", news);
      reported = news;
    }
    if (!options_.wait(kCheckPause)) {
      return cancelled("stopped on standby");
    }
  }
}

Status Leadership::end_lease_of_gone(Session& session) {
  LM_ASSIGN_OR_RETURN(
      const Rows rows,
      session.query("SELECT instance, EXISTS (SELECT FROM pg_stat_activity WHERE datname = "
                    "current_database() AND application_name = 'lightmill-server ' || instance) FROM lease"));
  const std::string at_work = rows.text(0, 0);
  if (rows.flag(0, 1)) {
    seen_ = at_work;
    checks_without_it_ = 0;
  }
  // If no connection of the active instance was ever visible, a pooler or a missing right may hide it. Then only the end
  // of its lease counts.
  if (at_work.empty() || at_work != seen_ || rows.flag(0, 1) || ++checks_without_it_ < kChecksUntilGone) {
    return ok_status();
  }
  return session.query("UPDATE lease SET expires = '-infinity' WHERE instance = $1", Parameters(at_work)).status();
}

Status Leadership::verify_chain(Session& session) {
  if (!chain_) {
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT epoch, commits, highest_job, secret FROM current_epoch, audit_secret"));
  const Sha256 id = sha256(rows.view(0, 3));
  std::copy_n(id.bytes.begin(), store_.size(), store_.begin());
  CommitMark mark{store_, mark_of(rows.natural(0, 0), rows.natural(0, 1)), {}, rows.natural(0, 2)};
  const Status whole = check_shared_chain(chain_->last(), mark);
  if (!whole.ok()) {
    LM_RETURN_IF_ERROR(check_accepted(whole));
  }
  highest_job_ = mark.highest_job = std::max(mark.highest_job, chain_->last() ? chain_->last()->highest_job : 0);
  if (!whole.ok()) {
    return chain_->restart(mark);
  }
  return chain_->last() == mark ? ok_status() : chain_->append(mark);
}

Status Leadership::check_accepted(const Status& loss) const {
  if (!options_.accept_loss) {
    return failed_precondition(
        "{}: {}. Restore a backup, or start once with --accept-loss to continue with what is left", session_.place(),
        message_of(loss));
  }
  spdlog::warn("--accept-loss: {}: {}", session_.place(), message_of(loss));
  return ok_status();
}

Status Leadership::record_commit(std::uint64_t number, std::uint64_t highest_job) {
  return chain_ ? chain_->append({store_, mark_of(epoch_, number), {}, highest_job}) : ok_status();
}

Status Leadership::take_again() {
  Session session(target(), {}, kLeaseCallTimeout);
  LM_ASSIGN_OR_RETURN(const std::string holder, try_to_take(session));
  return explain(holder.empty() ? ok_status() : failed_precondition("{} has the lease", holder));
}

void Leadership::keep_renewing() {
  const auto pause = options_.lease / 5;
  do {
    const MutexLock lock(mutex_);
    const auto until = std::chrono::steady_clock::now() + pause;
    while (!stopping_ && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
    }
    if (stopping_) {
      return;
    }
  } while (renew());
}

/// False once another coordinator has taken over. The lease survives an outage until another coordinator takes it.
bool Leadership::renew() {
  const double seconds = std::chrono::duration<double>(options_.lease).count();
  const Result<Rows> renewed = session_.query(
      "UPDATE lease SET expires = clock_timestamp() + make_interval(secs => $2) WHERE instance = $1 "
      "RETURNING holder",
      Parameters(instance_, seconds));
  if (!renewed.ok()) {
    spdlog::debug("cannot renew the lease: {}", message_of(renewed.status()));
    return true;
  }
  if (renewed->size() > 0) {
    return true;
  }
  options_.on_deposed(explain(failed_precondition("the lease is gone")));
  return false;
}

Status Leadership::explain(Status failure) const {
  if (failure.code() != StatusCode::kFailedPrecondition) {
    return failure;
  }
  return failed_precondition(
      "{}: another coordinator has taken over from epoch {} (this one was silent for {:g} s). This one cannot store "
      "anything any more and stops. Start it again as a standby",
      session_.place(), epoch(), std::chrono::duration<double>(options_.lease).count());
}

}  // namespace lightmill::postgres
