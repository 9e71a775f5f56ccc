#include "server/store/sqlite/sqlite_store.h"

#include "common/base/check.h"
#include "common/base/log.h"
#include "server/store/row_values.h"
#include "server/store/sqlite/database.h"
#include "server/store/sqlite/load_state.h"
#include "server/store/sqlite/schema.h"
#include "server/store/store_format.h"

namespace lightmill {
namespace {

using sqlite::Database;
using sqlite::Statement;
using stored::bytes_of;
using stored::view_of;

constexpr std::string_view kPutJob = R"sql(
INSERT INTO jobs VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,?15,?16,?17,?18,?19,?20,?21,?22,?23,?24,?25,?26,
  ?27,?28,?29)
ON CONFLICT (id) DO UPDATE SET request_id=?2, name=?3, owner=?4, host=?5, parent=?6, priority=?7, goal_samples=?8,
  goal_seconds=?9, state=?10, reason=?11, fingerprint_class=?12, active_seconds=?13, worker_seconds=?14,
  results_merged=?15, results_duplicate=?16, leases_lost=?17, copies_leased=?18, non_finite=?19,
  submitted_unix_ms=?20, finished_unix_ms=?21, goal_error=?22, reached=?23,
  goal_adaptive=?24, verify_share=?25, results_verified=?26, nodes_dropped=?27, allow_mixed=?28, checksum=?29)sql";

/// Kept for what comes next.
constexpr std::int64_t kSparePages = 1024;  // 16 MiB
constexpr const char* kGiveBack = "PRAGMA incremental_vacuum(512)";
/// The file shrinks with it, and the journal too.
constexpr const char* kTruncate = "PRAGMA wal_checkpoint(TRUNCATE)";

constexpr std::string_view kPutProgress = R"sql(
UPDATE jobs SET active_seconds=?2, worker_seconds=?3, results_merged=?4, results_duplicate=?5, leases_lost=?6,
  copies_leased=?7, non_finite=?8, results_verified=?9, nodes_dropped=?10 WHERE id = ?1)sql";

/// Every statement that a commit runs, prepared once.
struct Statements {
  Statement begin, commit, rollback;
  Statement put_job, put_progress, put_settings, put_method, put_asset, put_layer, put_error, delete_job, put_node,
      drop_node, put_result, put_verified, drop_results, drop_result_row, put_quarantine, drop_quarantine, put_token,
      drop_token, put_action, drop_action;
};

class SqliteStore final : public Store {
 public:
  SqliteStore(Database database, Statements statements)
      : database_(std::move(database)), statements_(std::move(statements)) {}

  Result<StoredState> load() override;
  Status commit(std::span<const StoreOp> ops) override;
  Status check_structure() override;
  bool tidy() override;

 private:
  Status apply(const PutJob& op);
  Status apply(const PutProgress& op);
  Status apply(const DeleteJobRows& op);
  Status apply(const PutNode& op);
  Status apply(const DropNode& op);
  Status apply(const PutResult& op);
  Status apply(const PutVerified& op);
  Status apply(const DropResults& op);
  Status apply(const DropResultRow& op);
  Status apply(const PutQuarantine& op);
  Status apply(const DropQuarantine& op);
  Status apply(const PutToken& op);
  Status apply(const DropToken& op);
  Status apply(const PutAction& op);
  Status apply(const DropAction& op);
  Status put_settings(const JobRecord& record);
  Status put_history(const JobRecord& record);
  Status roll_back(Status cause);

  Database database_;
  Statements statements_;
};

Result<StoredState> SqliteStore::load() {
  LM_RETURN_IF_ERROR(statements_.begin.run());
  std::vector<StoreOp> repairs;
  Result<StoredState> state = sqlite::load_state(database_, repairs);
  if (!state.ok()) {
    return roll_back(state.status());
  }
  for (const StoreOp& op : repairs) {
    if (Status status = std::visit([&](const auto& each) { return apply(each); }, op); !status.ok()) {
      return roll_back(std::move(status));
    }
  }
  if (Status status = statements_.commit.run(); !status.ok()) {
    return roll_back(std::move(status));
  }
  return state;
}

Status SqliteStore::check_structure() {
  LM_ASSIGN_OR_RETURN(Statement rows, database_.prepare("PRAGMA integrity_check(10)"));
  std::vector<std::string> wrong;
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      break;
    }
    if (rows.view(0) != "ok") {
      wrong.push_back(rows.text(0));
    }
  }
  return wrong.empty() ? ok_status() : data_loss("the database file is damaged: {}", fmt::join(wrong, "; "));
}

bool SqliteStore::tidy() {
  const auto free_pages = [this] { return database_.number("PRAGMA freelist_count").value_or(0); };
  const std::int64_t before = free_pages();
  if (before <= kSparePages || !database_.execute(kGiveBack).ok()) {
    return false;
  }
  const std::int64_t left = free_pages();
  if (left >= before) {
    return false;  // a file without auto_vacuum keeps its pages
  }
  if (const Status status = database_.execute(kTruncate); !status.ok()) {
    spdlog::debug("what was given back stays in the journal: {}", message_of(status));
  }
  return left > kSparePages;
}

// ---- commits ----

Status SqliteStore::commit(std::span<const StoreOp> ops) {
  LM_RETURN_IF_ERROR(statements_.begin.run());
  for (const StoreOp& op : ops) {
    if (Status status = std::visit([&](const auto& each) { return apply(each); }, op); !status.ok()) {
      return roll_back(std::move(status));
    }
  }
  if (Status status = statements_.commit.run(); !status.ok()) {
    return roll_back(std::move(status));
  }
  return ok_status();
}

Status SqliteStore::roll_back(Status cause) {
  // Some errors (a full disk) roll back by themselves.
  if (database_.in_transaction()) {
    if (Status status = statements_.rollback.run(); !status.ok()) {
      spdlog::error("cannot roll back: {}", message_of(status));
    }
  }
  if (cause.code() == StatusCode::kResourceExhausted) {
    (void)database_.execute(kTruncate);  // the journal's room is for the next try
  }
  return cause;
}

Status SqliteStore::apply(const PutJob& op) {
  const JobRecord& job = op.record;
  const JobCounters& counters = job.counters;
  const std::array<std::uint8_t, 16> checksum = bytes_of(stored::checksum_of(job));
  statements_.put_job.bind_all(job.id.value, job.spec.request_id, job.spec.name, job.spec.owner, job.spec.host,
                               job.spec.parent.value, job.spec.priority, job.spec.goal.samples, job.spec.goal.seconds,
                               stored::name_of(job.state), job.reason, job.fingerprint_class, job.active_seconds,
                               job.worker_seconds, counters.results_merged, counters.results_duplicate,
                               counters.leases_lost, counters.copies_leased, counters.non_finite, job.submitted_unix_ms,
                               job.finished_unix_ms, job.spec.goal.error, stored::name_of(job.reached),
                               int{job.spec.goal.adaptive}, job.spec.verify_share, counters.results_verified,
                               counters.nodes_dropped, int{job.spec.allow_mixed}, view_of(checksum));
  LM_RETURN_IF_ERROR(statements_.put_job.run());
  LM_RETURN_IF_ERROR(put_settings(job));
  return put_history(job);
}

/// A history only grows: what is there stays.
Status SqliteStore::put_history(const JobRecord& record) {
  for (const ErrorPoint& point : record.history) {
    statements_.put_error.bind_all(record.id.value, point.samples, point.worker_seconds, point.rel_mse,
                                   point.half_width);
    LM_RETURN_IF_ERROR(statements_.put_error.run());
  }
  return ok_status();
}

/// Settings never change but for a method that is chosen, so only the first write of a job stores the others.
Status SqliteStore::put_settings(const JobRecord& record) {
  const RenderSettings& settings = record.spec.settings;
  const MethodNotes& notes = record.method_notes;
  const std::string reasons = stored::lines_of(notes.reasons), notices = stored::lines_of(notes.notices),
                    candidates = stored::lines_of(notes.candidates);
  const ByteView allocation = std::as_bytes(record.allocation.shifts());
  statements_.put_settings.bind_all(record.id.value, as_byte_view(settings.scene), settings.width, settings.height,
                                    settings.crop.x, settings.crop.y, settings.crop.width, settings.crop.height,
                                    settings.seed, settings.method, settings.max_bounces, settings.renderer_version,
                                    settings.meters, int{notes.chosen}, reasons, notices, candidates, allocation);
  LM_RETURN_IF_ERROR(statements_.put_settings.run());
  if (database_.changes() == 0) {
    statements_.put_method.bind_all(record.id.value, settings.method, reasons, notices, candidates, allocation);
    return statements_.put_method.run();
  }
  for (std::size_t i = 0; i < settings.assets.size(); ++i) {
    statements_.put_asset.bind_all(record.id.value, std::uint64_t{i}, view_of(settings.assets[i].bytes));
    LM_RETURN_IF_ERROR(statements_.put_asset.run());
  }
  for (std::size_t i = 0; i < settings.layers.size(); ++i) {
    const LayerSpec& layer = settings.layers[i];
    statements_.put_layer.bind_all(record.id.value, std::uint64_t{i}, layer.name, layer.channels,
                                   stored::name_of(layer.kind));
    LM_RETURN_IF_ERROR(statements_.put_layer.run());
  }
  return ok_status();
}

Status SqliteStore::apply(const PutProgress& op) {
  const JobCounters& counters = op.counters;
  statements_.put_progress.bind_all(op.job.value, op.active_seconds, op.worker_seconds, counters.results_merged,
                                    counters.results_duplicate, counters.leases_lost, counters.copies_leased,
                                    counters.non_finite, counters.results_verified, counters.nodes_dropped);
  return statements_.put_progress.run();
}

Status SqliteStore::apply(const DeleteJobRows& op) {
  statements_.delete_job.bind_all(op.job.value);
  return statements_.delete_job.run();
}

Status SqliteStore::apply(const PutNode& op) {
  const std::array<std::uint8_t, 16> hash = bytes_of(hash_of(*op.node));
  statements_.put_node.bind_all(op.job.value, op.tile.value, op.node->range.level, op.node->range.index,
                                op.node->non_finite, view_of(hash), view_of(op.node->values));
  return statements_.put_node.run();
}

Status SqliteStore::apply(const DropNode& op) {
  statements_.drop_node.bind_all(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index);
  return statements_.drop_node.run();
}

Status SqliteStore::apply(const PutResult& op) {
  const std::array<std::uint8_t, 16> hash = bytes_of(op.hash);
  statements_.put_result.bind_all(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index,
                                  view_of(hash), op.by.worker, op.by.machine, int{op.to_verify},
                                  op.by.fingerprint_class, stored::checksum_of(op.key, op.hash, op.by));
  return statements_.put_result.run();
}

Status SqliteStore::apply(const PutVerified& op) {
  statements_.put_verified.bind_all(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index);
  return statements_.put_verified.run();
}

Status SqliteStore::apply(const DropResults& op) {
  statements_.drop_results.bind_all(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index);
  return statements_.drop_results.run();
}

Status SqliteStore::apply(const DropResultRow& op) {
  statements_.drop_result_row.bind_all(op.job.value, op.tile, op.level, op.index);
  return statements_.drop_result_row.run();
}

Status SqliteStore::apply(const PutQuarantine& op) {
  statements_.put_quarantine.bind_all(op.record.of.worker, op.record.of.machine, op.record.reason,
                                      op.record.since_unix_ms);
  return statements_.put_quarantine.run();
}

Status SqliteStore::apply(const DropQuarantine& op) {
  statements_.drop_quarantine.bind_all(op.worker);
  return statements_.drop_quarantine.run();
}

Status SqliteStore::apply(const PutToken& op) {
  const TokenRecord& token = op.token;
  const std::string roles = names_of(token.roles);
  statements_.put_token.bind_all(token.id, token.name, roles, view_of(token.hash.bytes), token.made_by,
                                 token.made_unix_s, token.until_unix_s);
  return statements_.put_token.run();
}

Status SqliteStore::apply(const DropToken& op) {
  statements_.drop_token.bind_all(op.id);
  return statements_.drop_token.run();
}

Status SqliteStore::apply(const PutAction& op) {
  const Action& action = op.action;
  statements_.put_action.bind_all(action.number, action.unix_ms, action.who, stored::name_of(action.proof),
                                  action.token, action.peer, action.what, action.job, action.about,
                                  static_cast<int>(action.outcome), action.message);
  return statements_.put_action.run();
}

Status SqliteStore::apply(const DropAction& op) {
  statements_.drop_action.bind_all(op.number);
  return statements_.drop_action.run();
}

// ---- opening ----

/// An exclusive lock on the file spares shared memory; secure_delete (on in Debian) would write every dropped node
/// again; large pages and rare checkpoints suit rows of 100 KB that live shortly.
constexpr const char* kSettings = R"sql(
PRAGMA locking_mode = EXCLUSIVE;
PRAGMA journal_mode = WAL;
PRAGMA synchronous = FULL;
PRAGMA secure_delete = OFF;
PRAGMA foreign_keys = ON;
PRAGMA wal_autocheckpoint = 4096;
PRAGMA journal_size_limit = 134217728;
PRAGMA cache_size = -32768;
PRAGMA temp_store = MEMORY;
)sql";

Status prepare_file(Database& database, const std::filesystem::path& file, bool is_new) {
  if (is_new) {
    LM_RETURN_IF_ERROR(database.execute("PRAGMA page_size = 16384; PRAGMA auto_vacuum = INCREMENTAL;"));
  }
  LM_RETURN_IF_ERROR(database.execute(kSettings));
  LM_ASSIGN_OR_RETURN(const std::int64_t application, database.number("PRAGMA application_id"));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  LM_ASSIGN_OR_RETURN(const std::int64_t tables, database.number("SELECT count(*) FROM sqlite_schema"));
  if (tables == 0 && version == 0) {
    return database.execute(
        fmt::format("BEGIN IMMEDIATE; PRAGMA application_id = {}; PRAGMA user_version = {}; {} COMMIT;",
                    sqlite::kApplicationId, kSqliteFormatVersion, sqlite::kSchema));
  }
  if (application != sqlite::kApplicationId) {
    return failed_precondition(
        "{} is not a Lightmill store (application id {:#x}): choose another directory with --data", file.string(),
        application);
  }
  return check_store_format(file.string(), version, kSqliteFormatVersion, "another directory with --data");
}

Result<Statements> prepare_statements(Database& database) {
  Statements all;
  LM_ASSIGN_OR_RETURN(all.begin, database.prepare("BEGIN IMMEDIATE"));
  LM_ASSIGN_OR_RETURN(all.commit, database.prepare("COMMIT"));
  LM_ASSIGN_OR_RETURN(all.rollback, database.prepare("ROLLBACK"));
  LM_ASSIGN_OR_RETURN(all.put_job, database.prepare(kPutJob));
  LM_ASSIGN_OR_RETURN(all.put_progress, database.prepare(kPutProgress));
  LM_ASSIGN_OR_RETURN(
      all.put_settings,
      database.prepare("INSERT OR IGNORE INTO job_settings VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,"
                       "?15,?16,?17,?18)"));
  LM_ASSIGN_OR_RETURN(
      all.put_method,
      database.prepare("UPDATE job_settings SET method = ?2, method_reasons = ?3, method_notices = ?4, "
                       "method_candidates = ?5, allocation = ?6 WHERE job = ?1 AND method_candidates <> ?5"));
  LM_ASSIGN_OR_RETURN(all.put_asset, database.prepare("INSERT INTO job_assets VALUES (?1,?2,?3)"));
  LM_ASSIGN_OR_RETURN(all.put_layer, database.prepare("INSERT INTO job_layers VALUES (?1,?2,?3,?4,?5)"));
  LM_ASSIGN_OR_RETURN(all.put_error, database.prepare("INSERT OR IGNORE INTO job_errors VALUES (?1,?2,?3,?4,?5)"));
  LM_ASSIGN_OR_RETURN(all.delete_job, database.prepare("DELETE FROM jobs WHERE id = ?1"));
  LM_ASSIGN_OR_RETURN(all.put_node,
                      database.prepare("INSERT OR REPLACE INTO nodes (job, tile, level, range_index, non_finite, hash, "
                                       "samples) VALUES (?1,?2,?3,?4,?5,?6,?7)"));
  LM_ASSIGN_OR_RETURN(
      all.drop_node,
      database.prepare("DELETE FROM nodes WHERE job = ?1 AND tile = ?2 AND level = ?3 AND range_index = ?4"));
  LM_ASSIGN_OR_RETURN(all.put_result,
                      database.prepare("INSERT OR REPLACE INTO results VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10)"));
  LM_ASSIGN_OR_RETURN(all.put_verified,
                      database.prepare("UPDATE results SET verification = 2 WHERE job = ?1 AND tile = ?2 AND level = "
                                       "?3 AND range_index = ?4"));
  LM_ASSIGN_OR_RETURN(all.drop_results,
                      database.prepare("DELETE FROM results WHERE job = ?1 AND tile = ?2 AND level <= ?3 AND "
                                       "range_index >> (?3 - level) = ?4"));
  LM_ASSIGN_OR_RETURN(
      all.drop_result_row,
      database.prepare("DELETE FROM results WHERE job = ?1 AND tile = ?2 AND level = ?3 AND range_index = ?4"));
  LM_ASSIGN_OR_RETURN(all.put_quarantine, database.prepare("INSERT OR REPLACE INTO quarantine VALUES (?1,?2,?3,?4)"));
  LM_ASSIGN_OR_RETURN(all.drop_quarantine, database.prepare("DELETE FROM quarantine WHERE worker = ?1"));
  LM_ASSIGN_OR_RETURN(all.put_token, database.prepare("INSERT OR REPLACE INTO tokens VALUES (?1,?2,?3,?4,?5,?6,?7)"));
  LM_ASSIGN_OR_RETURN(all.drop_token, database.prepare("DELETE FROM tokens WHERE id = ?1"));
  LM_ASSIGN_OR_RETURN(all.put_action,
                      database.prepare("INSERT OR IGNORE INTO actions VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11)"));
  LM_ASSIGN_OR_RETURN(all.drop_action, database.prepare("DELETE FROM actions WHERE number = ?1"));
  return all;
}

}  // namespace

Result<std::unique_ptr<Store>> open_sqlite_store(const std::filesystem::path& file) {
  std::error_code ignored;
  const std::uintmax_t size_bytes = std::filesystem::file_size(file, ignored);
  const bool is_new = ignored || size_bytes == 0;
  LM_ASSIGN_OR_RETURN(Database database, Database::open(file));
  LM_RETURN_IF_ERROR(prepare_file(database, file, is_new));
  LM_ASSIGN_OR_RETURN(Statements statements, prepare_statements(database));
  return std::unique_ptr<Store>(std::make_unique<SqliteStore>(std::move(database), std::move(statements)));
}

}  // namespace lightmill
