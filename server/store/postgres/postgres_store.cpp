#include "server/store/postgres/postgres_store.h"

#include <optional>

#include "common/base/check.h"
#include "common/base/log.h"
#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/leadership.h"
#include "server/store/postgres/load_state.h"
#include "server/store/postgres/postgres_assets.h"

namespace lightmill {
namespace {

using postgres::Leadership;
using postgres::Session;

/// One statement deletes a job, and takes a while for a large film.
constexpr auto kCommitPatience = std::chrono::minutes(5);

std::uint64_t highest_job_in(std::span<const StoreOp> ops) {
  std::uint64_t highest = 0;
  for (const StoreOp& op : ops) {
    const auto* put = std::get_if<PutJob>(&op);
    highest = put != nullptr ? std::max(highest, put->record.id.value) : highest;
  }
  return highest;
}

class PostgresStore final : public Store {
 public:
  explicit PostgresStore(std::shared_ptr<Leadership> leadership)
      : leadership_(std::move(leadership)),
        session_(leadership_->target(), postgres::commit_statements(), kCommitPatience) {}

  /// Compares the rows with the summary. FAILED_PRECONDITION if some are lost. Call it once, before everything else.
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
  stored::RowKeys keys_;
  bool loaded_ = false;
  std::uint64_t commits_ = 0;             ///< in this epoch
  std::uint64_t highest_job_ = 0;         ///< id in use
  std::optional<std::size_t> undecided_;  ///< number of writes of a commit that may be stored
};

Status PostgresStore::open() {
  LM_ASSIGN_OR_RETURN(const postgres::Summary summary, postgres::read_summary(session_));
  LM_ASSIGN_OR_RETURN(keys_, postgres::load_keys(session_));
  highest_job_ = std::max(summary.highest_job, leadership_->highest_job());
  const Status complete = stored::check_keys(keys_.sums(), summary.keys);
  if (complete.ok()) {
    return complete;
  }
  LM_RETURN_IF_ERROR(leadership_->check_accepted(complete));
  return commit({});  // with the sums of what is left
}

Result<StoredState> PostgresStore::load() {
  if (std::exchange(loaded_, true)) {
    LM_RETURN_IF_ERROR(leadership_->take_again());
    commits_ = 0;
    undecided_.reset();
  }
  std::vector<StoreOp> repairs;
  Result<StoredState> state = postgres::load_state(session_, specs_, repairs);
  if (!state.ok() && !session_.connected()) {
    repairs.clear();
    state = postgres::load_state(session_, specs_, repairs);
  }
  LM_RETURN_IF_ERROR(state.status());
  state->epoch = leadership_->epoch();
  state->next_job_id = std::max(state->next_job_id, highest_job_ + 1);
  highest_job_ = state->next_job_id - 1;
  if (!repairs.empty()) {
    LM_RETURN_IF_ERROR(commit(repairs));
  }
  return state;
}

Result<FilmPiece> PostgresStore::read_film(JobId job, const FilmPosition& after) {
  const bool was_connected = session_.connected();
  Result<FilmPiece> piece = postgres::read_film(session_, job, after);
  if (!piece.ok() && was_connected && !session_.connected()) {
    piece = postgres::read_film(session_, job, after);  // the connection may have been dead for a long time
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
  Status status =
      postgres::send_commit(session_, {leadership_->epoch(), commits_ + 1, highest_job}, ops, specs_, keys_);
  if (session_.connected() && session_.last_state() == postgres::kStoredAlready && !status.ok()) {
    LM_CHECK(undecided_.has_value());
    spdlog::info("the commit during which the connection was lost is stored");
    status = ok_status();
  }
  if (status.ok()) {
    if (Status recorded = leadership_->record_commit(commits_ + 1, highest_job); !recorded.ok()) {
      specs_.forget();
      keys_.forget();
      undecided_ = ops.size();  // stored, but not acknowledged
      return recorded;
    }
    highest_job_ = highest_job;
    specs_.keep();
    keys_.keep();
    ++commits_;
    undecided_.reset();
    return status;
  }
  specs_.forget();
  keys_.forget();
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
