#include "server/store/sqlite/sqlite_store.h"

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/log.h"
#include "server/store/commit_chain.h"
#include "server/store/migration.h"
#include "server/store/records.h"
#include "server/store/row_values.h"
#include "server/store/sqlite/database.h"
#include "server/store/sqlite/format_12.h"
#include "server/store/sqlite/journal_scan.h"
#include "server/store/sqlite/load_state.h"
#include "server/store/sqlite/schema.h"
#include "server/store/sqlite/store_row.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
using sqlite::Database;
using sqlite::Statement;
using stored::bytes_of;
using stored::view_of;

constexpr const char* kLossAdvice =
    "Restore a backup of the whole data folder, or start once with --accept-loss to continue with what is left";

/// Free pages that the file keeps for later writes.
constexpr std::int64_t kSparePages = 1024;  // 16 MiB
constexpr const char* kGiveBack = "PRAGMA incremental_vacuum(512)";
/// Shrinks the file and the journal.
constexpr const char* kTruncate = "PRAGMA wal_checkpoint(TRUNCATE)";

/// All statements of a commit, prepared once.
struct Statements {
  Statement begin, commit, rollback;
  std::array<Statement, stored::kTableCount> put_record, drop_record;
  Statement put_node, drop_node, put_result, put_verified, drop_results, drop_result_row;
  sqlite::StoreRowWriter store_row;
};

class SqliteStore final : public Store {
 public:
  SqliteStore(Database database, Statements statements, CommitChain chain, const sqlite::StoreRow& row,
              std::uint64_t next_job_id, stored::RowKeys keys)
      : database_(std::move(database)),
        statements_(std::move(statements)),
        chain_(std::move(chain)),
        row_(row),
        next_job_id_(next_job_id),
        keys_(std::move(keys)) {}

  Result<StoredState> load() override;
  Result<FilmPiece> read_film(JobId job, const FilmPosition& after) override {
    return sqlite::read_film(database_, job, after);
  }
  Status commit(std::span<const StoreOp> ops) override;
  Status check_structure() override;
  bool tidy() override;

 private:
  Result<StoredState> load_in_transaction();
  Status write(std::span<const StoreOp> ops);
  Status finish(sqlite::StoreRow next);
  template <class Op>
  Status apply(const Op& op);
  Status apply(const PutNode& op);
  Status apply(const DropNode& op);
  Status apply(const PutResult& op);
  Status apply(const PutVerified& op);
  Status apply(const DropResults& op);
  Status apply(const DropResultRow& op);
  Status run(Statement& statement, const NodeKey& key);
  Status chain();
  Status roll_back(Status cause);
  /// Adds numbers of the current commit to the running hash.
  template <class... Numbers>
  void add_to_hash(Numbers... numbers) {
    const std::array<std::uint64_t, sizeof...(Numbers)> all{static_cast<std::uint64_t>(numbers)...};
    writes_->append(view_of(all));
  }

  Database database_;
  Statements statements_;
  CommitChain chain_;
  sqlite::StoreRow row_;           ///< as stored
  std::uint64_t next_job_id_;      ///< as stored
  std::uint64_t highest_job_ = 0;  ///< of the current commit
  stored::StoredSpecs specs_;
  stored::RowKeys keys_;
  std::optional<Xxh3Hasher> writes_;  ///< of the current commit
  std::size_t writes_in_commit_ = 0;  ///< of the current commit
  /// number of writes of a commit that is stored, but not recorded in the chain
  std::optional<std::size_t> unchained_;
};

Result<StoredState> SqliteStore::load() {
  LM_RETURN_IF_ERROR(statements_.begin.run());
  Result<StoredState> state = load_in_transaction();
  if (!state.ok()) {
    return roll_back(state.status());
  }
  state->next_job_id = std::max(state->next_job_id, next_job_id_);
  return state;
}

Result<StoredState> SqliteStore::load_in_transaction() {
  std::vector<StoreOp> repairs;
  LM_ASSIGN_OR_RETURN(StoredState state, sqlite::load_state(database_, specs_, repairs));
  LM_RETURN_IF_ERROR(write(repairs));
  sqlite::StoreRow next = row_;
  state.epoch = ++next.epoch;
  state.secret = next.secret;
  LM_RETURN_IF_ERROR(finish(next));
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
    return false;  // files without auto_vacuum keep their pages
  }
  if (const Status status = database_.execute(kTruncate); !status.ok()) {
    spdlog::debug("the freed space stays in the journal: {}", message_of(status));
  }
  return left > kSparePages;
}

// ---- commits ----

Status SqliteStore::commit(std::span<const StoreOp> ops) {
  if (unchained_) {  // stored, but not recorded in the chain
    LM_CHECK(*unchained_ == ops.size(), "only the same commit may be tried again");
    return chain();
  }
  LM_RETURN_IF_ERROR(statements_.begin.run());
  if (Status status = write(ops); !status.ok()) {
    return roll_back(std::move(status));
  }
  if (Status status = finish(row_); !status.ok()) {
    return roll_back(std::move(status));
  }
  return ok_status();
}

Status SqliteStore::write(std::span<const StoreOp> ops) {
  writes_.emplace();
  add_to_hash(row_.hash.high, row_.hash.low);
  highest_job_ = next_job_id_ - 1;
  writes_in_commit_ = ops.size();
  for (const StoreOp& op : ops) {
    add_to_hash(op.index());
    LM_RETURN_IF_ERROR(std::visit([&](const auto& each) { return apply(each); }, op));
  }
  return ok_status();
}

/// COMMIT, then the record in the chain: an acknowledged commit is known in two places.
Status SqliteStore::finish(sqlite::StoreRow next) {
  ++next.commits;
  next.hash = writes_->finish();
  next.keys = keys_.sums();
  LM_RETURN_IF_ERROR(statements_.store_row.write(next));
  LM_RETURN_IF_ERROR(statements_.commit.run());
  specs_.keep();
  keys_.keep();
  row_ = next;
  next_job_id_ = highest_job_ + 1;
  unchained_ = writes_in_commit_;
  return chain();
}

Status SqliteStore::chain() {
  LM_RETURN_IF_ERROR(chain_.append({row_.id, row_.commits, row_.hash, next_job_id_ - 1}));
  unchained_.reset();
  return ok_status();
}

Status SqliteStore::roll_back(Status cause) {
  specs_.forget();
  keys_.forget();
  // Some errors, such as a full disk, roll back by themselves.
  if (database_.in_transaction()) {
    if (Status status = statements_.rollback.run(); !status.ok()) {
      spdlog::error("cannot roll back: {}", message_of(status));
    }
  }
  if (cause.code() == StatusCode::kResourceExhausted) {
    (void)database_.execute(kTruncate);  // frees the journal's space for the next attempt
  }
  return cause;
}

template <class Op>
Status SqliteStore::apply(const Op& op) {
  if constexpr (std::is_same_v<Op, PutJob>) {
    highest_job_ = std::max(highest_job_, op.record.id.value);
  }
  for (const stored::RowChange& change : stored::changes_of(op, specs_)) {
    const bool puts = change.message.has_value();
    const auto table = static_cast<std::size_t>(change.table);
    Statement& statement = (puts ? statements_.put_record : statements_.drop_record)[table];
    if (stored::info_of(change.table).numbered) {
      statement.bind_all(change.key.number);
    } else {
      statement.bind_all(as_byte_view(change.key.name));
    }
    puts ? keys_.put(change.table, change.key) : keys_.drop(change.table, change.key);
    add_to_hash(table, change.key.number, puts);
    writes_->append(as_byte_view(change.key.name));
    if (puts) {
      writes_->append(as_byte_view(*change.message));
      statement.bind_from(2, as_byte_view(*change.message),
                          stored::checksum_of(change.table, change.key, *change.message));
    }
    LM_RETURN_IF_ERROR(statement.run());
  }
  return ok_status();
}

Status SqliteStore::apply(const PutNode& op) {
  const Hash128 hash = stored::row_hash_of(op.job, op.tile, *op.node);
  const std::array<std::uint8_t, 16> bytes = bytes_of(hash);
  const SampleRange& range = op.node->range;
  add_to_hash(op.job.value, op.tile.value, range.level, range.index, op.node->non_finite, hash.high, hash.low);
  statements_.put_node.bind_all(op.job.value, op.tile.value, range.level, range.index, op.node->non_finite,
                                view_of(bytes), view_of(op.node->values));
  return statements_.put_node.run();
}

Status SqliteStore::run(Statement& statement, const NodeKey& key) {
  add_to_hash(key.job.value, key.tile.value, key.range.level, key.range.index);
  statement.bind_all(key.job.value, key.tile.value, key.range.level, key.range.index);
  return statement.run();
}

Status SqliteStore::apply(const DropNode& op) {
  return run(statements_.drop_node, op.key);
}

Status SqliteStore::apply(const PutResult& op) {
  const std::array<std::uint8_t, 16> hash = bytes_of(op.hash);
  const stored::Audit audit = op.to_verify ? stored::Audit::wanted : stored::Audit::none;
  const std::int64_t checksum = stored::checksum_of(op.key, op.hash, op.by, audit);
  add_to_hash(checksum);
  statements_.put_result.bind_all(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index,
                                  view_of(hash), as_byte_view(op.by.worker), as_byte_view(op.by.identity),
                                  static_cast<int>(audit), as_byte_view(op.by.fingerprint_class), checksum);
  return statements_.put_result.run();
}

Status SqliteStore::apply(const PutVerified& op) {
  return run(statements_.put_verified, op.key);
}

Status SqliteStore::apply(const DropResults& op) {
  return run(statements_.drop_results, op.key);
}

Status SqliteStore::apply(const DropResultRow& op) {
  add_to_hash(op.job.value, op.tile, op.level, op.index);
  statements_.drop_result_row.bind_all(op.job.value, op.tile, op.level, op.index);
  return statements_.drop_result_row.run();
}

// ---- opening ----

/// An exclusive lock on the file avoids shared memory. secure_delete (on in Debian) would overwrite every dropped node.
/// Large pages and rare checkpoints suit short-lived rows of 100 KB.
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

/// `may_be_new`: nothing was ever acknowledged here, so an empty file gets its tables and the values of `first`.
Status prepare_file(Database& database, const std::filesystem::path& file, bool is_new, bool may_be_new,
                    const sqlite::Beginning& first) {
  if (is_new) {
    LM_RETURN_IF_ERROR(database.execute("PRAGMA page_size = 16384; PRAGMA auto_vacuum = INCREMENTAL;"));
  }
  LM_RETURN_IF_ERROR(database.execute(kSettings));
  LM_ASSIGN_OR_RETURN(const std::int64_t application, database.number("PRAGMA application_id"));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  LM_ASSIGN_OR_RETURN(const std::int64_t tables, database.number("SELECT count(*) FROM sqlite_schema"));
  if (tables == 0 && version == 0 && may_be_new) {
    LM_RETURN_IF_ERROR(
        database.execute(fmt::format("BEGIN IMMEDIATE; PRAGMA application_id = {}; PRAGMA user_version = {}; {}",
                                     sqlite::kApplicationId, kSqliteFormatVersion, sqlite::kSchema)));
    LM_RETURN_IF_ERROR(sqlite::create_store_row(database, first));
    return database.execute("COMMIT");
  }
  if (tables == 0 && version == 0) {
    return failed_precondition("{} is empty, but commits were acknowledged. {}", file.string(), kLossAdvice);
  }
  if (application != sqlite::kApplicationId) {
    return failed_precondition(
        "{} is not a Lightmill store (application id {:#x}): choose another directory with --data", file.string(),
        application);
  }
  return version == kSameTablesVersion
             ? ok_status()
             : check_store_format(file.string(), version, kSqliteFormatVersion, "another directory with --data");
}

Result<Statements> prepare_statements(Database& database) {
  Statements all;
  LM_ASSIGN_OR_RETURN(all.begin, database.prepare("BEGIN IMMEDIATE"));
  LM_ASSIGN_OR_RETURN(all.commit, database.prepare("COMMIT"));
  LM_ASSIGN_OR_RETURN(all.rollback, database.prepare("ROLLBACK"));
  for (std::size_t i = 0; i < stored::kTableCount; ++i) {
    const stored::Table table{static_cast<std::uint8_t>(i)};
    const stored::TableInfo& info = stored::info_of(table);
    // Entries of the log never change.
    const char* const again = table == stored::Table::actions ? "NOTHING" : "UPDATE SET message = ?2, checksum = ?3";
    LM_ASSIGN_OR_RETURN(all.put_record[i],
                        database.prepare(fmt::format("INSERT INTO {} VALUES (?1,?2,?3) ON CONFLICT ({}) DO {}",
                                                     info.name, info.key, again)));
    LM_ASSIGN_OR_RETURN(all.drop_record[i],
                        database.prepare(fmt::format("DELETE FROM {} WHERE {} = ?1", info.name, info.key)));
  }
  LM_ASSIGN_OR_RETURN(all.store_row, sqlite::StoreRowWriter::prepare(database));
  LM_ASSIGN_OR_RETURN(all.put_node,
                      database.prepare("INSERT OR REPLACE INTO nodes (job, tile, level, range_index, non_finite, hash, "
                                       "samples) VALUES (?1,?2,?3,?4,?5,?6,?7)"));
  LM_ASSIGN_OR_RETURN(
      all.drop_node,
      database.prepare("DELETE FROM nodes WHERE job = ?1 AND tile = ?2 AND level = ?3 AND range_index = ?4"));
  LM_ASSIGN_OR_RETURN(all.put_result,
                      database.prepare("INSERT OR REPLACE INTO results VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10)"));
  LM_ASSIGN_OR_RETURN(
      all.put_verified,
      database.prepare("UPDATE results SET audit = 2, checksum = (checksum & ~3) | 2 WHERE job = ?1 AND "
                       "tile = ?2 AND level = ?3 AND range_index = ?4"));
  LM_ASSIGN_OR_RETURN(all.drop_results,
                      database.prepare("DELETE FROM results WHERE job = ?1 AND tile = ?2 AND level <= ?3 AND "
                                       "range_index >> (?3 - level) = ?4"));
  LM_ASSIGN_OR_RETURN(
      all.drop_result_row,
      database.prepare("DELETE FROM results WHERE job = ?1 AND tile = ?2 AND level = ?3 AND range_index = ?4"));
  return all;
}

/// Explains a loss by the state of the journal.
std::string damage_of(const sqlite::JournalScan& journal) {
  return journal.damaged ? fmt::format(" Its journal is damaged at frame {} of {}.", journal.sound_frames + 1,
                                       std::max(journal.frames, journal.sound_frames + 1))
                         : "";
}

fs::path with_suffix(const fs::path& file, std::string_view suffix) {
  return file.string() + std::string(suffix);
}

Result<std::unique_ptr<Store>> open_file(const fs::path& file, const SqliteOptions& options,
                                         const sqlite::Beginning& first = {}) {
  std::error_code ignored;
  const std::uintmax_t size_bytes = fs::file_size(file, ignored);
  const bool is_new = ignored || size_bytes == 0;
  LM_ASSIGN_OR_RETURN(CommitChain chain, CommitChain::open(with_suffix(file, "-chain")));
  const sqlite::JournalScan journal = sqlite::scan_journal(with_suffix(file, "-wal"));
  if (is_new && chain.last() && !options.accept_loss) {  // SQLite would delete its journal
    return failed_precondition("{} is empty or gone, but commits were acknowledged. {}", file.string(), kLossAdvice);
  }
  LM_ASSIGN_OR_RETURN(Database database, Database::open(file));
  database.checkpoint_at_close(false);  // a refused store is not changed
  LM_RETURN_IF_ERROR(prepare_file(database, file, is_new, !chain.last() || options.accept_loss, first));
  LM_ASSIGN_OR_RETURN(const sqlite::StoreRow row, sqlite::read_store_row(database));
  LM_ASSIGN_OR_RETURN(const std::int64_t highest,
                      database.number("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'jobs'"));
  CommitMark found{row.id, row.commits, row.hash, static_cast<std::uint64_t>(highest)};
  LM_ASSIGN_OR_RETURN(stored::RowKeys keys, sqlite::load_keys(database));
  Status complete = check_chain(chain.last(), found);
  complete = complete.ok() ? stored::check_keys(keys.sums(), row.keys) : complete;
  if (!complete.ok() && !options.accept_loss) {
    return failed_precondition("{}: {}.{} {}", file.string(), message_of(complete), damage_of(journal), kLossAdvice);
  }
  if (chain.last()) {
    found.highest_job = std::max(found.highest_job, chain.last()->highest_job);  // also of lost jobs
  }
  if (!complete.ok()) {
    spdlog::warn("--accept-loss: {}.{}", message_of(complete), damage_of(journal));
    LM_RETURN_IF_ERROR(chain.restart(found));
  }
  LM_ASSIGN_OR_RETURN(Statements statements, prepare_statements(database));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  if (version != kSqliteFormatVersion) {
    LM_RETURN_IF_ERROR(database.execute(fmt::format("PRAGMA user_version = {}", kSqliteFormatVersion)));
    spdlog::info("{} had store format {}; it has format {} now", file.string(), version, kSqliteFormatVersion);
  }
  database.checkpoint_at_close(true);
  return std::unique_ptr<Store>(std::make_unique<SqliteStore>(
      std::move(database), std::move(statements), std::move(chain), row, found.highest_job + 1, std::move(keys)));
}

// ---- migration ----

/// The state in the file, if it has the previous format.
Result<std::optional<StoredState>> read_format_before(const fs::path& file) {
  std::error_code ignored;
  if (fs::file_size(file, ignored) == 0 || ignored) {
    return std::nullopt;
  }
  LM_ASSIGN_OR_RETURN(Database database, Database::open(file));
  database.checkpoint_at_close(false);  // a refused store is not changed
  LM_RETURN_IF_ERROR(database.execute("PRAGMA locking_mode = EXCLUSIVE"));
  LM_ASSIGN_OR_RETURN(const std::int64_t application, database.number("PRAGMA application_id"));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  if (application != sqlite::kApplicationId || version != sqlite::kFormatBefore) {
    return std::nullopt;
  }
  LM_ASSIGN_OR_RETURN(StoredState state, sqlite::load_format_12(database));
  database.checkpoint_at_close(true);  // the file that is kept is complete without its journal
  return state;
}

/// Replaces a file of the previous format by a new one, and keeps the old one next to it. After a power failure at any
/// time, one of the two is in place.
Status migrate(const fs::path& file) {
  LM_ASSIGN_OR_RETURN(const std::optional<StoredState> state, read_format_before(file));
  if (!state) {
    return ok_status();
  }
  const fs::path fresh = with_suffix(file, ".new"),
                 kept = with_suffix(file, fmt::format(".format-{}", sqlite::kFormatBefore));
  spdlog::info("{} has store format {}; converting it to format {}", file.string(), sqlite::kFormatBefore,
               kSqliteFormatVersion);
  for (const char* const suffix : {"", "-wal", "-chain"}) {
    fs::remove(with_suffix(fresh, suffix));
  }
  {
    LM_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store,
                        open_file(fresh, {}, {state->secret, state->epoch, state->next_job_id - 1}));
    LM_RETURN_IF_ERROR(write_state(*state, *store));
  }
  std::error_code error;
  fs::create_hard_link(file, kept, error);
  if (error && error != std::errc::file_exists) {
    fs::copy_file(file, kept);
  }
  fs::rename(with_suffix(fresh, "-chain"), with_suffix(file, "-chain"));
  sync_folder_of(file);  // the chain goes before the file that needs it
  fs::rename(fresh, file);
  sync_folder_of(file);
  spdlog::info("the store of format {} is kept as {}, in case you return to an older lightmill-server",
               sqlite::kFormatBefore, kept.string());
  return ok_status();
}

}  // namespace

Result<std::unique_ptr<Store>> open_sqlite_store(const fs::path& file, const SqliteOptions& options) {
  try {
    LM_RETURN_IF_ERROR(migrate(file));
  } catch (const fs::filesystem_error& failure) {
    return unavailable("{} cannot be converted to format {}: {}", file.string(), kSqliteFormatVersion, failure.what());
  }
  return open_file(file, options);
}

}  // namespace lightmill
