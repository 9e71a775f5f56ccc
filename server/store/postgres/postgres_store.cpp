#include "server/store/postgres/postgres_store.h"

#include <algorithm>
#include <optional>

#include "common/base/check.h"
#include "common/base/log.h"
#include "server/store/load_state.h"
#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/leadership.h"
#include "server/store/postgres/postgres_assets.h"
#include "server/store/postgres/summary.h"

namespace lightmill {
namespace {

using postgres::Leadership;
using postgres::Session;

/// One statement deletes a job, and takes a while for a large film.
constexpr auto kCommitTimeout = std::chrono::minutes(5);

std::uint64_t highest_job_in(std::span<const StoreOp> ops) {
  std::uint64_t highest = 0;
  for (const StoreOp& op : ops) {
    const auto* put = std::get_if<PutJob>(&op);
    highest = put != nullptr ? std::max(highest, put->record.id.value) : highest;
  }
  return highest;
}

/// Nodes have about 100 KB, or several MB with many layers.
constexpr std::int64_t kNodesAtOnce = 32;

Status load_secret(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const postgres::Rows rows, session.query("SELECT secret, checksum FROM audit_secret"));
  LM_ASSIGN_OR_RETURN(state.secret, stored::digest_in(rows.size() == 1 ? rows.view(0, 0) : "", "the secret of audits"));
  LM_ASSIGN_OR_RETURN(const Sha256 checksum, stored::digest_in(rows.view(0, 1), "its checksum"));
  return checksum == sha256(rows.view(0, 0)) ? ok_status()
                                             : data_loss("the secret of audits in the database is damaged");
}

Result<FilmPiece> read_nodes(Session& session, JobId job, const FilmPosition& after) {
  LM_ASSIGN_OR_RETURN(
      const postgres::Rows rows,
      session.query("SELECT tile, level, range_index, non_finite, hash, samples FROM nodes WHERE job = $1 AND (tile, "
                    "level, range_index) > ($2, $3, $4) ORDER BY tile, level, range_index LIMIT $5",
                    postgres::Parameters(job.value, after.tile, after.level, after.index, kNodesAtOnce)));
  FilmPiece piece;
  for (int row = 0; row < rows.size(); ++row) {
    const FilmPosition position{rows.integer(row, 0), rows.integer(row, 1), rows.integer(row, 2)};
    stored::take_node(job, position, rows.natural(row, 3), rows.view(row, 4), rows.view(row, 5), piece);
    piece.last = position;
  }
  if (rows.size() < kNodesAtOnce) {
    piece.last.reset();
  }
  return piece;
}

/// Result of load().
struct Loaded {
  StoredState state;
  stored::RowSums found, written;
  std::vector<StoreOp> repairs;
};

Result<Loaded> load_all(Session& session, stored::StoredSpecs& specs) {
  const auto read = [&](JobId job, const FilmPosition& after) { return read_nodes(session, job, after); };
  Loaded loaded;
  LM_ASSIGN_OR_RETURN(const postgres::Summary summary, postgres::read_summary(session));
  loaded.written = summary.sums;
  LM_ASSIGN_OR_RETURN(loaded.state, stored::load_state(session, read, specs, loaded.found, loaded.repairs));
  LM_ASSIGN_OR_RETURN(const postgres::Rows highest, session.query("SELECT highest_job FROM current_epoch"));
  loaded.state.next_job_id = highest.natural(0, 0) + 1;
  LM_RETURN_IF_ERROR(load_secret(session, loaded.state));
  return loaded;
}

class PostgresStore final : public Store {
 public:
  explicit PostgresStore(std::shared_ptr<Leadership> leadership)
      : leadership_(std::move(leadership)),
        session_(leadership_->target(), postgres::commit_statements(), kCommitTimeout) {}

  /// Reads the summary. Call it once, before everything else.
  Status open();

  Result<StoredState> load() override;
  Result<FilmPiece> read_film(JobId job, const FilmPosition& after) override;
  Status commit(std::span<const StoreOp> ops) override;
  /// The database server checks itself (data checksums).
  Status check_structure() override { return ok_status(); }

 private:
  Status try_to_commit(std::span<const StoreOp> ops);

  const std::shared_ptr<Leadership> leadership_;
  Session session_;
  stored::StoredSpecs specs_;
  stored::RowSums sums_;  ///< as stored
  bool loaded_ = false;
  std::uint64_t commits_ = 0;             ///< in this epoch
  std::uint64_t highest_job_ = 0;         ///< id in use
  std::optional<std::size_t> undecided_;  ///< number of writes of a commit that may be stored
};

Status PostgresStore::open() {
  LM_ASSIGN_OR_RETURN(const postgres::Summary summary, postgres::read_summary(session_));
  sums_ = summary.sums;
  highest_job_ = std::max(summary.highest_job, leadership_->highest_job());
  return ok_status();
}

Result<StoredState> PostgresStore::load() {
  if (std::exchange(loaded_, true)) {
    LM_RETURN_IF_ERROR(leadership_->take_again());
    commits_ = 0;
    undecided_.reset();
  }
  Result<Loaded> loaded = load_all(session_, specs_);
  if (!loaded.ok() && !session_.connected()) {
    loaded = load_all(session_, specs_);
  }
  LM_RETURN_IF_ERROR(loaded.status());
  StoredState& state = loaded->state;
  state.epoch = leadership_->epoch();
  state.next_job_id = std::max(state.next_job_id, highest_job_ + 1);
  highest_job_ = state.next_job_id - 1;
  stored::RowSums all = loaded->found;
  if (const Status complete = loaded->found.check_tables(loaded->written); !complete.ok()) {
    LM_RETURN_IF_ERROR(leadership_->check_accepted(complete));
    LM_RETURN_IF_ERROR(stored::drop_orphans(session_, all));
  }
  stored::drop_unsound_tiles(all, loaded->written, state, loaded->repairs);
  sums_ = loaded->found;
  if (loaded->found != loaded->written || !loaded->repairs.empty()) {
    LM_RETURN_IF_ERROR(commit(loaded->repairs));
  }
  return std::move(state);
}

Result<FilmPiece> PostgresStore::read_film(JobId job, const FilmPosition& after) {
  const bool was_connected = session_.connected();
  Result<FilmPiece> piece = read_nodes(session_, job, after);
  if (!piece.ok() && was_connected && !session_.connected()) {
    piece = read_nodes(session_, job, after);  // the connection may have been dead for a long time
  }
  return piece;
}

Status PostgresStore::commit(std::span<const StoreOp> ops) {
  LM_CHECK(!undecided_ || *undecided_ == ops.size(), "only the same commit may be tried again");
  const bool was_connected = session_.connected();
  Status status = try_to_commit(ops);
  if (was_connected && !session_.connected()) {
    status = try_to_commit(ops);  // the connection may have been dead for a long time
  }
  return status;
}

Status PostgresStore::try_to_commit(std::span<const StoreOp> ops) {
  const std::uint64_t highest_job = std::max(highest_job_, highest_job_in(ops));
  postgres::Summary after{leadership_->epoch(), commits_ + 1, highest_job, sums_};
  Status status = postgres::send_commit(session_, after, ops, specs_);
  if (session_.connected() && session_.last_state() == postgres::kStoredAlready && !status.ok()) {
    LM_CHECK(undecided_.has_value());
    spdlog::info("the commit during which the connection was lost is stored");
    const Result<postgres::Summary> stored = postgres::read_summary(session_);
    status = stored.status();
    after.sums = stored.ok() ? stored->sums : after.sums;
  }
  if (status.ok()) {
    if (Status recorded = leadership_->record_commit(after.commits, highest_job); !recorded.ok()) {
      specs_.forget();
      undecided_ = ops.size();  // stored, but not acknowledged
      return recorded;
    }
    highest_job_ = highest_job;
    sums_ = after.sums;
    specs_.keep();
    ++commits_;
    undecided_.reset();
    return status;
  }
  specs_.forget();
  if (!session_.connected()) {
    undecided_ = ops.size();
  }
  return leadership_->explain(status);
}

}  // namespace

Status check_postgres_url(const std::string& url) {
  return postgres::Target{url, ""}.describe().status();
}

Result<PostgresStores> open_postgres(PostgresOptions options) {
  LM_ASSIGN_OR_RETURN(std::shared_ptr<Leadership> leadership,
                      Leadership::take({options.url, options.lease, options.read_only, options.chain,
                                        options.accept_loss, options.wait, options.on_deposed}));
  LM_ASSIGN_OR_RETURN(std::string place, leadership->target().describe());
  LM_ASSIGN_OR_RETURN(std::unique_ptr<AssetStore> assets, postgres::open_postgres_assets(leadership, options.assets));
  auto store = std::make_unique<PostgresStore>(std::move(leadership));
  LM_RETURN_IF_ERROR(store->open());
  return PostgresStores{std::move(store), std::move(assets), std::move(place)};
}

}  // namespace lightmill
