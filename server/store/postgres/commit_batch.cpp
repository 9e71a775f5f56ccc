#include "server/store/postgres/commit_batch.h"

#include "common/base/check.h"
#include "server/store/row_values.h"

namespace lightmill::postgres {
namespace {

using stored::bytes_of;
using stored::view_of;

/// PostgreSQL takes 1 GiB in one value.
constexpr std::size_t kMostNodeBytes = std::size_t{512} << 20;

/// In the order of kStatements.
enum Sql : int {
  kBegin,
  kCommit,
  kTakeTurn,
  kPutJob,
  kHighestJob,
  kPutProgress,
  kPutSettings,
  kPutMethod,
  kPutAsset,
  kPutLayer,
  kPutError,
  kDeleteJob,
  kPutNode,
  kDropNode,
  kPutResult,
  kPutVerified,
  kDropResults,
  kDropResultRow,
  kPutQuarantine,
  kDropQuarantine,
  kPutToken,
  kDropToken,
  kPutAction,
  kDropAction,
  kSqlCount
};

constexpr std::array<const char*, kSqlCount> kStatements{
    "BEGIN",
    "COMMIT",
    "SELECT take_turn($1, $2)",
    "INSERT INTO jobs (id, request_id, name, owner, host, parent, priority, goal_samples, goal_seconds, goal_error, "
    "goal_adaptive, state, reason, reached, fingerprint_class, active_seconds, worker_seconds, results_merged, "
    "results_duplicate, leases_lost, copies_leased, non_finite, submitted_unix_ms, finished_unix_ms, verify_share, "
    "results_verified, nodes_dropped, allow_mixed, checksum) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, "
    "$12, $13, "
    "$14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24, $25, $26, $27, $28, $29) "
    "ON CONFLICT (id) DO UPDATE SET request_id = $2, name = $3, owner = $4, host = $5, parent = $6, priority = $7, "
    "goal_samples = $8, goal_seconds = $9, goal_error = $10, goal_adaptive = $11, state = $12, reason = $13, "
    "reached = $14, fingerprint_class = $15, active_seconds = $16, worker_seconds = $17, results_merged = $18, "
    "results_duplicate = $19, leases_lost = $20, copies_leased = $21, non_finite = $22, submitted_unix_ms = $23, "
    "finished_unix_ms = $24, verify_share = $25, results_verified = $26, nodes_dropped = $27, "
    "allow_mixed = $28, checksum = $29",
    "UPDATE turn SET highest_job = $1 WHERE highest_job < $1",
    "UPDATE jobs SET active_seconds = $2, worker_seconds = $3, results_merged = $4, results_duplicate = $5, "
    "leases_lost = $6, copies_leased = $7, non_finite = $8, results_verified = $9, nodes_dropped = $10 WHERE id = $1",
    "INSERT INTO job_settings (job, scene, width, height, crop_x, crop_y, crop_width, crop_height, seed, max_bounces, "
    "renderer_version, meters, method, method_chosen, method_reasons, method_notices, method_candidates, allocation) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18) "
    "ON CONFLICT (job) DO NOTHING",
    "UPDATE job_settings SET method = $2, method_reasons = $3, method_notices = $4, method_candidates = $5, "
    "allocation = $6 WHERE job = $1 AND method_candidates <> $5",
    "INSERT INTO job_assets VALUES ($1, $2, $3) ON CONFLICT DO NOTHING",
    "INSERT INTO job_layers VALUES ($1, $2, $3, $4, $5) ON CONFLICT DO NOTHING",
    "INSERT INTO job_errors VALUES ($1, $2, $3, $4, $5) ON CONFLICT DO NOTHING",
    "DELETE FROM jobs WHERE id = $1",
    "INSERT INTO nodes (job, tile, level, range_index, non_finite, hash, samples) VALUES ($1, $2, $3, $4, $5, $6, $7) "
    "ON CONFLICT (job, tile, level, range_index) DO UPDATE SET non_finite = $5, hash = $6, samples = $7",
    "DELETE FROM nodes WHERE job = $1 AND tile = $2 AND level = $3 AND range_index = $4",
    "INSERT INTO results VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10) ON CONFLICT (job, tile, level, range_index) "
    "DO UPDATE SET hash = $5, worker = $6, machine = $7, verification = $8, fingerprint_class = $9, checksum = $10",
    "UPDATE results SET verification = 2 WHERE job = $1 AND tile = $2 AND level = $3 AND range_index = $4",
    // In whichever order the conditions are looked at, no shift is one that cannot be.
    "DELETE FROM results WHERE job = $1 AND tile = $2 AND level <= $3 AND "
    "range_index >> ($3 - LEAST(GREATEST(level, 0), $3))::integer = $4",
    "DELETE FROM results WHERE job = $1 AND tile = $2 AND level = $3 AND range_index = $4",
    "INSERT INTO quarantine VALUES ($1, $2, $3, $4) ON CONFLICT (worker) DO UPDATE SET machine = $2, reason = $3, "
    "since_unix_ms = $4",
    "DELETE FROM quarantine WHERE worker = $1",
    "INSERT INTO tokens VALUES ($1, $2, $3, $4, $5, $6, $7) ON CONFLICT (id) DO UPDATE SET name = $2, roles = $3, "
    "hash = $4, made_by = $5, made_unix_s = $6, until_unix_s = $7",
    "DELETE FROM tokens WHERE id = $1",
    "INSERT INTO actions VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11) ON CONFLICT (number) DO NOTHING",
    "DELETE FROM actions WHERE number = $1",
};

class Sender {
 public:
  Sender(Session& session, StoredJobs& jobs) : session_(session), jobs_(jobs) {}

  void operator()(const PutJob& op) {
    const JobRecord& job = op.record;
    const JobCounters& counters = job.counters;
    const std::array<std::uint8_t, 16> checksum = bytes_of(stored::checksum_of(job));
    session_.add(
        kPutJob,
        Parameters(job.id.value, job.spec.request_id, job.spec.name, job.spec.owner, job.spec.host,
                   job.spec.parent.value, job.spec.priority, job.spec.goal.samples, job.spec.goal.seconds,
                   job.spec.goal.error, int{job.spec.goal.adaptive}, stored::name_of(job.state), job.reason,
                   stored::name_of(job.reached), job.fingerprint_class, job.active_seconds, job.worker_seconds,
                   counters.results_merged, counters.results_duplicate, counters.leases_lost, counters.copies_leased,
                   counters.non_finite, job.submitted_unix_ms, job.finished_unix_ms, job.spec.verify_share,
                   counters.results_verified, counters.nodes_dropped, int{job.spec.allow_mixed}, view_of(checksum)));
    put_settings(job);
    // A history only grows: what is there stays.
    for (const ErrorPoint& point : job.history) {
      session_.add(kPutError,
                   Parameters(job.id.value, point.samples, point.worker_seconds, point.rel_mse, point.half_width));
    }
  }
  void operator()(const PutProgress& op) {
    const JobCounters& counters = op.counters;
    session_.add(kPutProgress, Parameters(op.job.value, op.active_seconds, op.worker_seconds, counters.results_merged,
                                          counters.results_duplicate, counters.leases_lost, counters.copies_leased,
                                          counters.non_finite, counters.results_verified, counters.nodes_dropped));
  }
  void operator()(const DeleteJobRows& op) {
    session_.add(kDeleteJob, Parameters(op.job.value));
    jobs_.erase(op.job);
  }
  void operator()(const PutNode& op) {
    const std::array<std::uint8_t, 16> hash = bytes_of(hash_of(*op.node));
    session_.add(kPutNode, Parameters(op.job.value, op.tile.value, op.node->range.level, op.node->range.index,
                                      op.node->non_finite, view_of(hash), view_of(op.node->values)));
  }
  void operator()(const DropNode& op) { add_key(kDropNode, op.key); }
  void operator()(const PutResult& op) {
    const std::array<std::uint8_t, 16> hash = bytes_of(op.hash);
    session_.add(kPutResult, Parameters(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index,
                                        view_of(hash), op.by.worker, op.by.machine, int{op.to_verify},
                                        op.by.fingerprint_class, stored::checksum_of(op.key, op.hash, op.by)));
  }
  void operator()(const PutVerified& op) { add_key(kPutVerified, op.key); }
  void operator()(const DropResults& op) { add_key(kDropResults, op.key); }
  void operator()(const DropResultRow& op) {
    session_.add(kDropResultRow, Parameters(op.job.value, op.tile, op.level, op.index));
  }
  void operator()(const PutQuarantine& op) {
    session_.add(kPutQuarantine,
                 Parameters(op.record.of.worker, op.record.of.machine, op.record.reason, op.record.since_unix_ms));
  }
  void operator()(const DropQuarantine& op) { session_.add(kDropQuarantine, Parameters(op.worker)); }
  void operator()(const PutToken& op) {
    const TokenRecord& token = op.token;
    session_.add(kPutToken, Parameters(token.id, token.name, names_of(token.roles), view_of(token.hash.bytes),
                                       token.made_by, token.made_unix_s, token.until_unix_s));
  }
  void operator()(const DropToken& op) { session_.add(kDropToken, Parameters(op.id)); }
  void operator()(const PutAction& op) {
    const Action& action = op.action;
    session_.add(kPutAction, Parameters(action.number, action.unix_ms, action.who, stored::name_of(action.proof),
                                        action.token, action.peer, action.what, action.job, action.about,
                                        static_cast<int>(action.outcome), action.message));
  }
  void operator()(const DropAction& op) { session_.add(kDropAction, Parameters(op.number)); }

 private:
  void add_key(Sql statement, const NodeKey& key) {
    session_.add(statement, Parameters(key.job.value, key.tile.value, key.range.level, key.range.index));
  }
  /// Settings never change but for a method that is chosen.
  void put_settings(const JobRecord& record) {
    const RenderSettings& settings = record.spec.settings;
    const MethodNotes& notes = record.method_notes;
    const std::string reasons = stored::lines_of(notes.reasons), notices = stored::lines_of(notes.notices),
                      candidates = stored::lines_of(notes.candidates);
    const ByteView allocation = std::as_bytes(record.allocation.shifts());
    const std::uint64_t id = record.id.value;
    if (jobs_.contains(record.id)) {
      session_.add(kPutMethod, Parameters(id, settings.method, reasons, notices, candidates, allocation));
      return;
    }
    jobs_.insert(record.id);
    session_.add(kHighestJob, Parameters(id));
    session_.add(kPutSettings,
                 Parameters(id, as_byte_view(settings.scene), settings.width, settings.height, settings.crop.x,
                            settings.crop.y, settings.crop.width, settings.crop.height, settings.seed,
                            settings.max_bounces, settings.renderer_version, settings.meters, settings.method,
                            int{notes.chosen}, reasons, notices, candidates, allocation));
    for (std::size_t i = 0; i < settings.assets.size(); ++i) {
      session_.add(kPutAsset, Parameters(id, std::uint64_t{i}, view_of(settings.assets[i].bytes)));
    }
    for (std::size_t i = 0; i < settings.layers.size(); ++i) {
      const LayerSpec& layer = settings.layers[i];
      session_.add(kPutLayer,
                   Parameters(id, std::uint64_t{i}, layer.name, layer.channels, stored::name_of(layer.kind)));
    }
  }

  Session& session_;
  StoredJobs& jobs_;
};

Status check_sizes(std::span<const StoreOp> ops) {
  for (const StoreOp& op : ops) {
    const auto* put = std::get_if<PutNode>(&op);
    if (put != nullptr && put->node->values.size() * sizeof(float) > kMostNodeBytes) {
      return internal_error("job {}: a node of tile {} has {} bytes, more than the {} that can be stored",
                            put->job.value, put->tile.value, put->node->values.size() * sizeof(float), kMostNodeBytes);
    }
  }
  return ok_status();
}

}  // namespace

std::span<const char* const> commit_statements() {
  return kStatements;
}

bool StoredJobs::contains(JobId job) const {
  const auto change = changes_.find(job);
  return change != changes_.end() ? change->second : stored_.contains(job);
}

void StoredJobs::keep() {
  for (const auto& [job, is_stored] : changes_) {
    if (is_stored) {
      stored_.insert(job);
    } else {
      stored_.erase(job);
    }
  }
  changes_.clear();
}

Status send_commit(Session& session, std::uint64_t epoch, std::uint64_t number, std::span<const StoreOp> ops,
                   StoredJobs& jobs) {
  LM_RETURN_IF_ERROR(check_sizes(ops));
  LM_RETURN_IF_ERROR(session.begin_batch());
  session.add(kBegin);
  session.add(kTakeTurn, Parameters(epoch, number));
  Sender sender(session, jobs);
  for (const StoreOp& op : ops) {
    std::visit(sender, op);
  }
  session.add(kCommit);
  return session.finish_batch();
}

}  // namespace lightmill::postgres
