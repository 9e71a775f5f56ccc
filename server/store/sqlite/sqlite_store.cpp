#include "server/store/sqlite/sqlite_store.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/log.h"
#include "server/store/commit_chain.h"
#include "server/store/load_state.h"
#include "server/store/migration.h"
#include "server/store/old_rows.h"
#include "server/store/row_writer.h"
#include "server/store/sqlite/database.h"
#include "server/store/sqlite/format_12.h"
#include "server/store/sqlite/format_14.h"
#include "server/store/sqlite/journal_scan.h"
#include "server/store/sqlite/schema.h"
#include "server/store/sqlite/store_row.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
using sqlite::Database;
using sqlite::Statement;

/// Free pages that the file keeps for later writes.
constexpr std::int64_t kSparePages = 1024;  // 16 MiB
constexpr const char* kGiveBack = "PRAGMA incremental_vacuum(512)";
/// Shrinks the file and the journal.
constexpr const char* kTruncate = "PRAGMA wal_checkpoint(TRUNCATE)";

/// Condition of a result whose samples lie in a range.
constexpr const char* kWithin = "job = $1 AND tile = $2 AND level <= $3 AND range_index >> ($3 - level) = $4";

/// All statements of a commit, prepared once.
struct Statements {
  Statement begin, commit, rollback;
  std::array<Statement, stored::kRowStatementCount> rows;
  sqlite::StoreRowWriter store_row;
};

/// Of a value, in the running hash. Rows with longer values have a hash or checksum of them.
constexpr std::size_t kMaxHashedBytes = 4096;

class SqliteStore final : public Store {
 public:
  SqliteStore(Database database, Statements statements, CommitChain chain, sqlite::StoreRow row,
              const stored::RowSums& sums, std::uint64_t next_job_id, const SqliteOptions& options)
      : database_(std::move(database)),
        statements_(std::move(statements)),
        chain_(std::move(chain)),
        options_(options),
        row_(std::move(row)),
        sums_(sums),
        next_job_id_(next_job_id) {}

  Result<StoredState> load() override;
  Result<FilmPiece> read_film(JobId job, const FilmPosition& after) override;
  Status commit(std::span<const StoreOp> ops) override;
  Status check_structure() override { return sqlite::check_structure(database_); }
  bool tidy() override;

 private:
  Result<StoredState> load_in_transaction();
  Status write(std::span<const StoreOp> ops);
  Status finish(sqlite::StoreRow next);
  Status chain();
  Status roll_back(Status cause);
  /// Adds a value of the current commit to the running hash.
  void add_to_hash(std::uint64_t number) { writes_->append(std::as_bytes(std::span(&number, 1))); }
  void add_to_hash(ByteView bytes) {
    add_to_hash(bytes.size());
    writes_->append(bytes.first(std::min(bytes.size(), kMaxHashedBytes)));
  }

  Database database_;
  Statements statements_;
  CommitChain chain_;
  const SqliteOptions options_;
  sqlite::StoreRow row_;           ///< as stored
  stored::RowSums sums_;           ///< of the rows
  stored::RowSums next_sums_;      ///< of the current commit
  std::uint64_t next_job_id_;      ///< as stored
  std::uint64_t highest_job_ = 0;  ///< of the current commit
  stored::StoredSpecs specs_;
  std::optional<Xxh3Hasher> writes_;  ///< of the current commit
  std::size_t writes_in_commit_ = 0;  ///< of the current commit
  /// number of writes of a commit that is stored, but not recorded in the chain
  std::optional<std::size_t> unchained_;
};

Result<StoredState> SqliteStore::load() {
  LM_RETURN_IF_ERROR(statements_.begin.run());
  Result<StoredState> state = load_in_transaction();
  if (!state.ok()) {
    database_.checkpoint_at_close(false);  // a refused store is not changed
    return roll_back(state.status());
  }
  state->next_job_id = next_job_id_;
  return state;
}

Result<StoredState> SqliteStore::load_in_transaction() {
  std::vector<StoreOp> repairs;
  const auto read = [this](JobId job, const FilmPosition& after) { return read_film(job, after); };
  LM_ASSIGN_OR_RETURN(const stored::RowSums written, stored::RowSums::from_bytes(row_.sums));
  stored::RowSums found;
  LM_ASSIGN_OR_RETURN(StoredState state, stored::load_state(database_, read, specs_, found, repairs));
  stored::RowSums all = found;
  if (const Status complete = found.check_tables(written); !complete.ok()) {
    if (!options_.accept_loss) {
      return failed_precondition("{}: {}. {}", database_.file(), message_of(complete), sqlite::kLossAdvice);
    }
    spdlog::warn("--accept-loss: {}", message_of(complete));
    LM_RETURN_IF_ERROR(stored::drop_orphans(database_, all));
  }
  stored::drop_unsound_tiles(all, written, state, repairs);
  sums_ = found;
  LM_RETURN_IF_ERROR(write(repairs));
  sqlite::StoreRow next = row_;
  state.epoch = ++next.epoch;
  state.secret = next.secret;
  LM_RETURN_IF_ERROR(finish(next));
  return state;
}

Result<FilmPiece> SqliteStore::read_film(JobId job, const FilmPosition& after) {
  LM_ASSIGN_OR_RETURN(Statement rows, database_.prepare("SELECT tile, level, range_index, non_finite, hash, samples "
                                                        "FROM nodes WHERE job = ?1 AND (tile, level, range_index) > "
                                                        "(?2, ?3, ?4) ORDER BY tile, level, range_index"));
  rows.bind_all(job.value, after.tile, after.level, after.index);
  FilmPiece piece;
  for (std::size_t size_bytes = 0; size_bytes < stored::kFilmPieceBytes;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      piece.last.reset();
      break;
    }
    piece.last = {rows.integer(0), rows.integer(1), rows.integer(2)};
    size_bytes += stored::take_node(job, *piece.last, rows.natural(3), rows.view(4), rows.view(5), piece);
  }
  return piece;
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
  Status status = write(ops);
  status = status.ok() ? finish(row_) : std::move(status);
  return status.ok() ? std::move(status) : roll_back(std::move(status));
}

Status SqliteStore::write(std::span<const StoreOp> ops) {
  writes_.emplace();
  add_to_hash(row_.hash.high);
  add_to_hash(row_.hash.low);
  next_sums_ = sums_;
  highest_job_ = next_job_id_ - 1;
  writes_in_commit_ = ops.size();
  for (const StoreOp& op : ops) {
    if (const auto* put = std::get_if<PutJob>(&op)) {
      highest_job_ = std::max(highest_job_, put->record.id.value);
    }
    LM_RETURN_IF_ERROR(stored::write_rows(op, specs_, next_sums_, [&](int statement, const auto&... values) {
      add_to_hash(static_cast<std::uint64_t>(statement));
      (add_to_hash(values), ...);
      Statement& row = statements_.rows[static_cast<std::size_t>(statement)];
      row.bind_all(values...);
      return row.run([&](const Statement& each) { stored::count_row(statement, each, next_sums_); });
    }));
  }
  return ok_status();
}

/// COMMIT, then the mark in the commit chain: an acknowledged commit is known in two places.
Status SqliteStore::finish(sqlite::StoreRow next) {
  ++next.commits;
  next.hash = writes_->finish();
  next.sums = next_sums_.bytes();
  LM_RETURN_IF_ERROR(statements_.store_row.write(next));
  LM_RETURN_IF_ERROR(statements_.commit.run());
  specs_.keep();
  sums_ = next_sums_;
  row_ = std::move(next);
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
  // Some errors, such as a full disk, roll back by themselves.
  if (database_.in_transaction()) {
    if (Status status = statements_.rollback.run(); !status.ok()) {
      spdlog::error("a write failed, and cannot be undone: {}. Restart the coordinator", message_of(status));
    }
  }
  if (cause.code() == StatusCode::kResourceExhausted) {
    (void)database_.execute(kTruncate);  // frees the journal's space for the next attempt
  }
  return cause;
}

// ---- opening ----

Result<Statements> prepare_statements(Database& database) {
  Statements all;
  LM_ASSIGN_OR_RETURN(all.begin, database.prepare("BEGIN IMMEDIATE"));
  LM_ASSIGN_OR_RETURN(all.commit, database.prepare("COMMIT"));
  LM_ASSIGN_OR_RETURN(all.rollback, database.prepare("ROLLBACK"));
  LM_ASSIGN_OR_RETURN(all.store_row, sqlite::StoreRowWriter::prepare(database));
  const auto sql = stored::row_statements(kWithin);
  for (std::size_t i = 0; i < sql.size(); ++i) {
    LM_ASSIGN_OR_RETURN(all.rows[i], database.prepare(sql[i]));
  }
  return all;
}

fs::path with_suffix(const fs::path& file, std::string_view suffix) {
  return file.string() + std::string(suffix);
}

fs::path kept_name(const fs::path& file, std::int64_t version) {
  return with_suffix(file, fmt::format(".format-{}", version));
}

void log_kept(const fs::path& kept, std::int64_t version) {
  spdlog::info("the store of format {} is kept as {}, in case you return to an older lightmill-server", version,
               kept.string());
}

/// Copies the database and its chain beside the file, then converts the database. After a power failure at any time,
/// either it has its old format or the copies are complete.
Status keep_and_convert(Database& database, const fs::path& file, std::int64_t version, sqlite::StoreRow& row) {
  const fs::path kept = kept_name(file, version), fresh = with_suffix(kept, ".new");
  spdlog::info("{} has store format {}. Converting it to format {}", file.string(), version, kSqliteFormatVersion);
  std::error_code error;
  fs::remove(fresh, error);
  LM_ASSIGN_OR_RETURN(Statement copy, database.prepare("VACUUM INTO ?1"));
  const std::string name = fresh.string();
  copy.bind_all(name);
  Status status = copy.run();
  status = status.ok() ? sync_file(fresh) : status;
  if (status.ok()) {
    const fs::path chain = with_suffix(kept, "-chain");
    fs::copy_file(with_suffix(file, "-chain"), chain, fs::copy_options::overwrite_existing, error);
    status = error ? unavailable("{}", error.message()) : sync_file(chain);
  }
  if (status.ok()) {
    fs::rename(fresh, kept, error);
    status = error ? unavailable("{}", error.message()) : ok_status();
  }
  if (!status.ok()) {
    fs::remove(fresh, error);
    return with_context(status, fmt::format("{} cannot be kept as {}", file.string(), kept.string()));
  }
  LM_RETURN_IF_ERROR(sync_folder_of(kept));
  LM_RETURN_IF_ERROR(sqlite::convert_format_14(database, row));
  log_kept(kept, version);
  return ok_status();
}

Result<std::unique_ptr<Store>> open_file(const fs::path& file, const SqliteOptions& options,
                                         const sqlite::Beginning& first = {}) {
  std::error_code ignored;
  const std::uintmax_t size_bytes = fs::file_size(file, ignored);
  const bool is_new = ignored || size_bytes == 0;
  LM_ASSIGN_OR_RETURN(CommitChain chain, CommitChain::open(with_suffix(file, "-chain")));
  const sqlite::JournalScan journal = sqlite::scan_journal(with_suffix(file, "-wal"));
  if (is_new && chain.last() && !options.accept_loss) {  // SQLite would delete its journal
    return failed_precondition("{} is empty or gone, but commits were acknowledged. {}", file.string(),
                               sqlite::kLossAdvice);
  }
  LM_ASSIGN_OR_RETURN(Database database, Database::open(file));
  database.checkpoint_at_close(false);  // a refused store is not changed
  LM_RETURN_IF_ERROR(
      sqlite::prepare_file(database, file, is_new, !chain.last() || options.accept_loss, journal, first));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  LM_ASSIGN_OR_RETURN(sqlite::StoreRow row, sqlite::read_store_row(database));
  LM_ASSIGN_OR_RETURN(const std::int64_t highest, database.number(sqlite::kHighestJob));
  CommitMark found{row.id, row.commits, row.hash, static_cast<std::uint64_t>(highest)};
  Status complete = check_chain(chain.last(), found);
  if (complete.ok() && version != kSqliteFormatVersion) {
    complete = stored::check_old_sums(database, row.sums);
  }
  if (!complete.ok() && !options.accept_loss) {
    return failed_precondition("{}: {}.{} {}", file.string(), message_of(complete), sqlite::problem_of(journal),
                               sqlite::kLossAdvice);
  }
  if (chain.last()) {
    found.highest_job = std::max(found.highest_job, chain.last()->highest_job);  // also of lost jobs
  }
  if (!complete.ok()) {
    spdlog::warn("--accept-loss: {}.{}", message_of(complete), sqlite::problem_of(journal));
    LM_RETURN_IF_ERROR(chain.restart(found));
  }
  if (version != kSqliteFormatVersion) {
    LM_RETURN_IF_ERROR(keep_and_convert(database, file, version, row));
  }
  LM_ASSIGN_OR_RETURN(Statements statements, prepare_statements(database));
  LM_ASSIGN_OR_RETURN(const stored::RowSums sums, stored::RowSums::from_bytes(row.sums));
  database.checkpoint_at_close(true);
  return std::unique_ptr<Store>(std::make_unique<SqliteStore>(std::move(database), std::move(statements),
                                                              std::move(chain), std::move(row), sums,
                                                              found.highest_job + 1, options));
}

// ---- migration ----

/// The state in the file, if it has format 12 (kOldestFormat).
Result<std::optional<StoredState>> read_format_12(const fs::path& file) {
  std::error_code ignored;
  if (fs::file_size(file, ignored) == 0 || ignored) {
    return std::nullopt;
  }
  LM_ASSIGN_OR_RETURN(Database database, Database::open(file));
  database.checkpoint_at_close(false);  // a refused store is not changed
  LM_RETURN_IF_ERROR(database.execute("PRAGMA locking_mode = EXCLUSIVE"));
  LM_ASSIGN_OR_RETURN(const std::int64_t application, database.number("PRAGMA application_id"));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  if (application != sqlite::kApplicationId || version != sqlite::kOldestFormat) {
    return std::nullopt;
  }
  LM_ASSIGN_OR_RETURN(StoredState state, sqlite::load_format_12(database));
  database.checkpoint_at_close(true);  // the file that is kept is complete without its journal
  return state;
}

/// Replaces a file of format 12 by one of the current format, and keeps the old one next to it. After a power failure
/// at any time, one of the two is in place.
Status migrate(const fs::path& file) {
  LM_ASSIGN_OR_RETURN(const std::optional<StoredState> state, read_format_12(file));
  if (!state) {
    return ok_status();
  }
  const fs::path fresh = with_suffix(file, ".new"), kept = kept_name(file, sqlite::kOldestFormat);
  spdlog::info("{} has store format {}. Converting it to format {}", file.string(), sqlite::kOldestFormat,
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
  LM_RETURN_IF_ERROR(sync_folder_of(file));  // the chain goes before the file that needs it
  fs::rename(fresh, file);
  LM_RETURN_IF_ERROR(sync_folder_of(file));
  log_kept(kept, sqlite::kOldestFormat);
  return ok_status();
}

}  // namespace

bool sqlite_has_acknowledged(const fs::path& file) {
  const fs::path chain = with_suffix(file, "-chain");
  if (std::error_code error; !fs::exists(chain, error)) {
    return false;
  }
  const Result<CommitChain> opened = CommitChain::open(chain);
  return !opened.ok() || opened->last();  // open_sqlite_store() names the error
}

Result<std::unique_ptr<Store>> open_sqlite_store(const fs::path& file, const SqliteOptions& options) {
  try {
    LM_RETURN_IF_ERROR(migrate(file));
  } catch (const fs::filesystem_error& failure) {
    return unavailable("{} cannot be converted to format {}: {}", file.string(), kSqliteFormatVersion, failure.what());
  }
  return open_file(file, options);
}

}  // namespace lightmill
