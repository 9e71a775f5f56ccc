// How results are checked and merged.
#include "common/base/check.h"
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// Thread time of one result, far beyond any lease: larger sums could leave the numbers that fairness compares.
constexpr double kMaxResultSeconds = 1e7;

/// NaN, infinities and −0 have no place in a node. Branch-free, so that it is done eight values at a time.
bool values_are_sound(std::span<const float> values) {
  std::uint32_t bad = 0;
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    bad |= static_cast<std::uint32_t>((bits & 0x7f800000u) == 0x7f800000u) |
           static_cast<std::uint32_t>(bits == 0x80000000u);
  }
  return bad == 0;
}

}  // namespace

Status Coordinator::State::check_result(const Job& job, const WorkerResult& result) const {
  const NodeKey& key = result.key;
  if (key.tile.value >= job.film.grid().tile_count()) {
    return invalid_argument("tile {} of {}", key.tile.value, job.film.grid().tile_count());
  }
  if (result.node.range != key.range) {
    return invalid_argument("its node has other samples than its key");
  }
  if (const std::size_t expected = job.film.expected_values(key.tile, key.range);
      result.node.values.size() != expected) {
    return invalid_argument("{} values instead of {}", result.node.values.size(), expected);
  }
  if (!values_are_sound(result.node.values)) {
    return invalid_argument("a value is NaN, infinite or -0");
  }
  if (!(result.seconds >= 0 && result.seconds <= kMaxResultSeconds)) {
    return invalid_argument("{} seconds", result.seconds);
  }
  if (hash_of(result.node) != result.hash) {
    return data_loss("its hash does not fit");
  }
  return ok_status();
}

void Coordinator::State::on_result(SessionId session, WorkerResult result, Time now, Step& step) {
  pace.came(static_cast<double>(result.node.values.size() * sizeof(float)) + kBytesOfAResult, now);
  const NodeKey key = result.key;
  const LeaseId lease_id = result.lease;
  Job* const job = find_job(key.job);
  const Session& from = sessions.at(session);
  const Renderer by{from.worker, from.machine, job == nullptr ? "" : job->class_of_result(from.fingerprint_class)};
  const std::string& name = by.worker;
  const bool wanted = job != nullptr && job->active() && !job->record.fingerprint_class.empty() && !job->undecided() &&
                      job->digest == result.render_digest && !in_quarantine(by) && key.range.level <= kMaxRangeLevel &&
                      key.range.end() <= job->plan->goal_of(key.tile);
  if (!wanted) {
    // Unknown, ended, another farm's, beyond the decided count, or not to be believed: the worker may forget it.
    send_after_commit(step, session, ResultAck{{key}});
    if (const auto lease = leases.find(lease_id);
        lease != leases.end() && lease->second.worker == name && lease->second.unit.job == key.job) {
      const SampleRange range = lease->second.unit.range;
      end_verification_of(lease_id, key.tile, now, step);  // the lease may end with it
      job->plan->release(lease_id, key.tile, range);
      tile_done(lease_id, key.tile, now, step, true);
      refresh_queue(*job);
      finish_if_complete(*job, now, step);
      serve_all(now, step);
    }
    return;
  }
  if (const Status status = check_result(*job, result); !status.ok()) {
    reject_result(session, result, status, now, step);
    return;
  }
  if (Worker* const worker = worker_of(session)) {
    worker->jobs[key.job].confirmed = true;
    ++worker->results;
    // Over a slow line heartbeats queue behind results: whoever sends results is alive, with all that it holds.
    for (const LeaseId id : worker->leases) {
      renew(leases.at(id), now);
    }
  }
  job->digest_durable = job->digest_durable || job->bound_before(lease_id);
  const bool cost_was_known = job->seconds_per_pixel_sample.known();
  merge_result(*job, by, std::move(result), now, step);
  // Also duplicates may stand on a node whose commit is still to come, so every acknowledgement waits.
  send_after_commit(step, session, ResultAck{{key}});
  settle(*job, key, lease_id, now, step);
  end_verification_of(lease_id, key.tile, now, step);
  refresh_queue(*job);
  if (record_error(*job, false)) {
    put_job(*job, step);
  }
  put_progress(*job, now, step);
  const std::uint64_t wanted_before = job->plan->goal();
  const bool others_wait = finish_if_complete(*job, now, step) || job->plan->goal() > wanted_before ||
                           job->verifications.waiting() || job->seconds_per_pixel_sample.known() != cost_was_known;
  if (Worker* const worker = worker_of(session)) {
    serve(*worker, now, step);
  }
  if (others_wait) {
    serve_all(now, step);
  }
}

void Coordinator::State::reject_result(SessionId session, const WorkerResult& result, const Status& error, Time now,
                                       Step& step) {
  const std::string name = sessions.at(session).worker;
  note(step, Note::Level::warning, about(result.key.job, name),
       "worker {}: result of job {}, tile {}, samples [{}, {}) is dropped: {}", name, result.key.job.value,
       result.key.tile.value, result.key.range.first(), result.key.range.end(), message_of(error));
  send_after_commit(step, session, ResultAck{{result.key}});
  distrust(session, result.lease, error, now, step);
}

void Coordinator::State::distrust(SessionId session, LeaseId lease_id, const Status& error, Time now, Step& step) {
  const std::string name = sessions.at(session).worker;
  const auto take_back = [&](LeaseId id, bool cancel) {
    Job& job = *jobs.at(leases.at(id).unit.job);
    end_lease(id, cancel, true, now, step);
    put_progress(job, now, step);
    finish_if_complete(job, now, step);
  };
  if (const auto lease = leases.find(lease_id); lease != leases.end() && lease->second.worker == name) {
    take_back(lease_id, true);
  }
  Worker* const worker = worker_of(session);
  if (worker == nullptr) {
    return;
  }
  if (++worker->bad_results >= limits.max_bad_results) {
    dismiss(session, fmt::format("{} damaged results, the last: {}", worker->bad_results, message_of(error)), now,
            step);
    while (!worker->leases.empty()) {
      take_back(*worker->leases.begin(), false);
    }
    forget_if_gone(name, step);
  } else {
    serve(*worker, now, step);
  }
  serve_all(now, step);
}

void Coordinator::State::merge_result(Job& job, const Renderer& by, WorkerResult result, Time now, Step& step) {
  const std::string& name = by.worker;
  const NodeKey key = result.key;
  forget_orphans(step);  // before anything is recorded in their place
  const auto pixel_samples = static_cast<double>(key.range.count()) * static_cast<double>(job.pixels_of(key.tile));
  job.record.worker_seconds += result.seconds;
  if (result.seconds > 0) {
    job.seconds_per_pixel_sample.add(result.seconds / pixel_samples);
    job.costly_tile.add(result.seconds / pixel_samples);
    if (Worker* const worker = find_worker(name)) {
      WorkerJob& known = worker->jobs[job.id()];
      known.seconds_per_pixel_sample.add(result.seconds / pixel_samples);
      known.costly_tile.add(result.seconds / pixel_samples);
      worker->rate.add(pixel_samples, now);
      worker->pixel_samples += key.range.count() * static_cast<std::uint64_t>(job.pixels_of(key.tile));
    }
  }
  const std::uint64_t non_finite_before = job.film.non_finite();
  const std::uint64_t samples_before = job.film.pixel_samples();
  MergeOutcome outcome = job.film.merge(key.tile, std::make_shared<const Node>(std::move(result.node)));
  if (outcome.kind != MergeOutcome::Kind::merged) {
    ++job.record.counters.results_duplicate;
    ++totals.results_repeated;
    if (outcome.kind == MergeOutcome::Kind::mismatch && !job.record.spec.allow_mixed) {
      note(step, Note::Level::warning, about(job.id(), name),
           "job {}, tile {}, samples [{}, {}): worker {} has other bits than what was merged before; its result is "
           "dropped",
           job.id().value, key.tile.value, key.range.first(), key.range.end(), name);
    }
    compare_result(job, key, result.hash, by, outcome.kind == MergeOutcome::Kind::mismatch, now, step);
    return;
  }
  ++job.record.counters.results_merged;
  ++totals.results_merged;
  if (job.suspicions.erase(key.tile) > 0) {
    job.plan->set_alone(key.tile, false);
  }
  if (job.record.spec.goal.error > 0 && job.film.samples(key.tile) == job.plan->goal_of(key.tile)) {
    job.error.refresh(job.film, key.tile);  // so that little is left to do once the last tile is there
  }
  job.record.counters.non_finite += job.film.non_finite() - non_finite_before;
  job.rate.add(static_cast<double>(job.film.pixel_samples() - samples_before), now);
  totals.pixel_samples += job.film.pixel_samples() - samples_before;
  if (!job.pictured && job.film.min_samples() > 0) {
    job.pictured = true;
    const std::int64_t since_ms = unix_ms(now) - job.record.submitted_unix_ms;  // a clock may have been set back
    totals.first_picture.add(static_cast<double>(std::max<std::int64_t>(since_ms, 0)) / 1000);
  }
  note_parts(job, key, by, outcome);
  for (const SampleRange& range : outcome.removed) {
    step.writes.push_back(DropNode{{key.job, key.tile, range}});
  }
  for (NodePtr& node : outcome.added) {
    step.writes.push_back(PutNode{key.job, key.tile, std::move(node)});
  }
  bool replaced = false;
  for (const SampleRange& range : outcome.removed) {
    replaced = replaced || key.range.contains(range);
  }
  if (replaced) {
    step.writes.push_back(DropResults{key});
    for (const auto& [place, lease] : job.verifications.close_within(key.tile, key.range)) {
      if (lease) {
        tile_done(*lease, key.tile, now, step, false);
      }
    }
  }
  // Whoever sends more than was asked for has it looked at.
  const double share = job.record.spec.verify_share;
  const bool to_verify = share > 0 && !by.machine.empty() && (replaced || is_chosen(secret, key, share));
  step.writes.push_back(PutResult{key, result.hash, by, to_verify});
  if (to_verify) {
    job.verifications.open({key.range, key.tile}, {by, result.hash});
  }
}

}  // namespace lightmill
