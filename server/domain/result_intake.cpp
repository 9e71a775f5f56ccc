#include "server/domain/result_intake.h"

#include <bit>

namespace lightmill {
namespace {

/// Most thread time of one result, far beyond any lease. Larger sums could lose precision where fairness compares them.
constexpr double kMaxResultSeconds = 1e7;

/// A node must not have NaN, −0, or values beyond `largest`. Branch-free, so that eight values are checked at a time.
bool values_are_sound(std::span<const float> values, float largest) {
  const auto most = std::bit_cast<std::uint32_t>(largest);
  std::uint32_t bad = 0;
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    bad |= static_cast<std::uint32_t>((bits & 0x7fffffffu) > most) | static_cast<std::uint32_t>(bits == 0x80000000u);
  }
  return bad == 0;
}

Status check_node(const Job& job, const WorkerResult& result) {
  if (result.damaged) {
    return data_loss("its hash does not match its values");
  }
  const NodeKey& key = result.key;
  if (key.tile.value >= job.film().grid().tile_count()) {
    return invalid_argument("there is no tile {}: the film has {}", key.tile.value, job.film().grid().tile_count());
  }
  if (result.node.range != key.range) {
    return invalid_argument("its node has {} samples from {}, not the {} from {} of its lease",
                            result.node.range.count(), result.node.range.first(), key.range.count(), key.range.first());
  }
  if (const std::size_t expected = job.film().expected_values(key.tile, key.range);
      result.node.values.size() != expected) {
    return invalid_argument("it has {} values instead of {}", result.node.values.size(), expected);
  }
  if (!values_are_sound(result.node.values, largest_value(key.range))) {
    return invalid_argument("a value is NaN, too large or -0");
  }
  if (!(result.seconds >= 0 && result.seconds <= kMaxResultSeconds)) {
    return invalid_argument("it claims {} s of thread time", result.seconds);
  }
  return ok_status();
}

/// Whether the job takes such results: it has not ended, has a class and a method, and wants these samples.
bool wants(const Job& job, const WorkerResult& result) {
  const SampleRange& range = result.key.range;
  return job.active() && !job.record().fingerprint_class.empty() && !job.undecided() &&
         job.digest() == result.render_digest && range.level <= kMaxRangeLevel &&
         range.end() <= job.plan().goal_of(result.key.tile);
}

}  // namespace

Status ResultIntake::check(const Job& job, const std::string& worker, const WorkerResult& result) const {
  if (!signer_.verify(result.tag, worker, result.lease, result.render_digest, result.key)) {
    return make_error(StatusCode::kPermissionDenied, "these samples were never granted to this worker");
  }
  return check_node(job, result);
}

void ResultIntake::take(SessionId session, WorkerResult result, const Event& event) {
  scheduler_.result_received(result, event.now);
  const NodeKey key = result.key;
  const LeaseId lease = result.lease;
  Job* const job = jobs_.find(key.job);
  const WorkerRegistry::Session& from = *workers_.find_session(session);
  const Renderer by{from.worker, from.identity, job == nullptr ? "" : job->class_of_result(from.fingerprint_class)};
  if (job == nullptr || !wants(*job, result) || quarantined_.contains(by)) {
    drop_unwanted(session, result, by.worker, event);
    return;
  }
  if (const Status status = check(*job, by.worker, result); !status.ok()) {
    reject(session, result, status, event);
    return;
  }
  if (Worker* const worker = workers_.of(session)) {
    worker->job(key.job).confirmed = true;
    worker->count_good_result();
    // On a slow link heartbeats queue behind results. So a result renews all leases of its worker.
    for (const LeaseId id : worker->leases()) {
      leases_.renew(id, event.now);
    }
  }
  job->came_back(lease);
  if (Worker* const worker = workers_.find(by.worker); worker != nullptr && is_granted(by.worker, result)) {
    if (!worker->job(key.job).delivered) {
      leases_.prepared(lease, seconds_that_count(by.worker, result, event.now), event.now);
    }
    workers_.delivered(*worker, key.job, key.range.count() * job->pixels_of(key.tile), event.now);
  }
  result.seconds = seconds_that_count(by.worker, result, event.now);
  const bool cost_was_known = job->cost().known();
  const Lease* const open = leases_.find(lease);
  merge(*job, by, std::move(result), open == nullptr || open->worker != by.worker, event);
  // Every acknowledgement waits: also a duplicate may depend on a node that is not committed yet.
  event.send_after_commit(session, ResultAck{{key}});
  leases_.settle(*job, key, lease, event);
  leases_.audit_done(lease, key.tile, event);
  if (const Worker* const worker = workers_.of(session)) {
    leases_.audited_by(*worker, key, event);
  }
  queue_.refresh(*job);
  if (job->record_error(false)) {
    job->store(event);
  }
  job->store_progress(event);
  const std::uint64_t wanted_before = job->plan().goal();
  const bool others_wait = life_cycle_.finish_if_complete(*job, event) || job->plan().goal() > wanted_before ||
                           job->audits().waiting() || job->cost().known() != cost_was_known;
  if (Worker* const worker = workers_.of(session)) {
    scheduler_.serve(*worker, event);
  }
  if (others_wait) {
    scheduler_.serve_all(event);
  }
}

void ResultIntake::drop_unwanted(SessionId session, const WorkerResult& result, const std::string& worker,
                                 const Event& event) {
  if (Job* const job = jobs_.find(result.key.job)) {
    job->note_unkept_result();
  }
  event.send_after_commit(session, ResultAck{{result.key}});
  if (const Lease* const lease = leases_.find(result.lease);
      lease != nullptr && lease->worker == worker && lease->unit.job == result.key.job) {
    Job& job = jobs_.at(result.key.job);
    leases_.give_up_tile(result.lease, result.key.tile, event);
    queue_.refresh(job);
    life_cycle_.finish_if_complete(job, event);
    scheduler_.serve_all(event);
  }
}

void ResultIntake::reject(SessionId session, const WorkerResult& result, const Status& error, const Event& event) {
  const std::string& name = workers_.find_session(session)->worker;
  event.warn(about(result.key.job, name), "worker {}: result of job {}, tile {}, samples [{}, {}) is dropped: {}", name,
             result.key.job.value, result.key.tile.value, result.key.range.first(), result.key.range.end(),
             message_of(error));
  jobs_.at(result.key.job).note_unkept_result();
  event.send_after_commit(session, ResultAck{{result.key}});
  dismissals_.distrust(session, result.lease, error, event);
}

bool ResultIntake::is_granted(const std::string& worker, const WorkerResult& result) const {
  const Lease* const lease = leases_.find(result.lease);
  return lease != nullptr && lease->worker == worker && lease->wants(result.key.tile);
}

double ResultIntake::seconds_that_count(const std::string& worker, const WorkerResult& result, Time now) const {
  return is_granted(worker, result) ? leases_.at(result.lease).possible_seconds(result.seconds, now) : 0;
}

void ResultIntake::count_cost(Job& job, const Renderer& by, const WorkerResult& result, const Event& event) {
  const std::uint64_t pixel_samples = result.key.range.count() * job.pixels_of(result.key.tile);
  job.add_cost(result.seconds, pixel_samples);
  if (Worker* const worker = workers_.find(by.worker); worker != nullptr && result.seconds > 0) {
    worker->rendered(job.id(), result.seconds / static_cast<double>(pixel_samples), pixel_samples, event.now);
  }
}

void ResultIntake::count_duplicate(Job& job, const NodeKey& key, const Renderer& by, bool differs, const Event& event) {
  ++totals_.results_duplicate;
  if (differs && !job.spec().allow_mixed) {
    event.warn(
        about(job.id(), by.worker),
        "job {}, tile {}, samples [{}, {}): worker {} sent other bits than the merged ones. Its result is dropped",
        job.id().value, key.tile.value, key.range.first(), key.range.end(), by.worker);
  }
}

void ResultIntake::merge(Job& job, const Renderer& by, WorkerResult result, bool late, const Event& event) {
  const NodeKey key = result.key;
  provenance_.forget_orphans(event);  // before new results are recorded in their place
  count_cost(job, by, result, event);
  const auto [outcome, fresh, first_picture] =
      job.merge(key.tile, std::make_shared<const Node>(std::move(result.node)), by.identity, result.seconds, event.now);
  if (outcome.kind != MergeOutcome::Kind::merged) {
    const bool differs = outcome.kind == MergeOutcome::Kind::mismatch;
    count_duplicate(job, key, by, differs, event);
    quarantine_.resolve(job, key, audits_.compare(job, key, result.hash, by, differs, event), event);
    return;
  }
  ++totals_.results_merged;
  totals_.pixel_samples += fresh;
  if (first_picture) {
    const std::int64_t since_ms = event.unix_ms - job.record().submitted_unix_ms;  // negative if the clock was set back
    totals_.first_picture.add(static_cast<double>(std::max<std::int64_t>(since_ms, 0)) / 1000);
  }
  audits_.merged(job, key, result.hash, by, outcome, late, event);
}

}  // namespace lightmill
