// How leases are given, settled and lost.
#include "common/base/check.h"
#include "common/base/quantities.h"
#include "common/methods/spec/method_spec.h"
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// A worker gets more units than the limit says while they hold fewer tiles than it has threads, up to so many times
/// more.
constexpr std::uint32_t kSmallUnitsFactor = 8;
constexpr double kLeastUnitScale = 1.0 / 64;
/// While nobody knows what a job's samples cost, units are of one sample: no more of them are out than the coordinator
/// takes in within so long, lest thousands of workers send theirs at once.
constexpr double kTriedSeconds = 0.5;

std::size_t index_of(const Lease& lease, TileId tile) {
  const auto at = std::lower_bound(lease.unit.tiles.begin(), lease.unit.tiles.end(), tile);
  return at != lease.unit.tiles.end() && *at == tile ? static_cast<std::size_t>(at - lease.unit.tiles.begin())
                                                     : lease.unit.tiles.size();
}

}  // namespace

Worker* Coordinator::State::find_worker(const std::string& name) {
  const auto found = workers.find(name);
  return found == workers.end() ? nullptr : &found->second;
}

bool Coordinator::State::wants_more(const Worker& worker) const {
  if (!counts(worker) || worker.silent) {
    return false;
  }
  const std::size_t held = worker.leases.size();
  if (held == 1 && leases.at(*worker.leases.begin()).alone) {
    return false;
  }
  return held < limits.leases_per_worker || (worker.tiles_out < worker.hello.threads * limits.leases_per_worker &&
                                             held < std::size_t{limits.leases_per_worker} * kSmallUnitsFactor);
}

bool Coordinator::State::suits(const std::string& fingerprint_class, const std::string& renderer_version,
                               const Job& job) {
  const std::string& fixed = job.record.fingerprint_class;
  return (job.record.spec.allow_mixed || fixed.empty() || fixed == fingerprint_class) &&
         job.record.spec.settings.renderer_version == renderer_version;
}

bool Coordinator::State::suits(const Worker& worker, const Job& job) {
  return !worker.quarantined && suits(worker.hello.fingerprint_class, worker.hello.renderer_version, job);
}

bool Coordinator::State::may_render(const Worker& worker, const Job& job) const {
  return suits(worker, job) && !worker.too_large.contains(job.id());
}

double Coordinator::State::node_bytes(const Job& job) {
  const auto pixels = std::min<std::uint64_t>(job.film.grid().pixel_count(), std::uint64_t{kTileSize} * kTileSize);
  return static_cast<double>(job.film.layout().most_values() * pixels * sizeof(float));
}

bool Coordinator::State::enough_is_tried(const Job& job) const {
  if (job.seconds_per_pixel_sample.known()) {
    return false;
  }
  const auto pixels = std::min<std::uint64_t>(job.film.grid().pixel_count(), std::uint64_t{kTileSize} * kTileSize);
  const auto results = static_cast<double>(job.plan->out_pixel_samples()) / static_cast<double>(pixels);
  return results * node_bytes(job) > kTriedSeconds * pace.bytes_per_second();
}

UnitAim Coordinator::State::aim_for(const Worker& worker, const Job& job, Time now) const {
  const auto known = worker.jobs.find(job.id());
  const bool measured = known != worker.jobs.end() && known->second.seconds_per_pixel_sample.known();
  UnitAim aim;
  aim.farm_threads = static_cast<std::uint32_t>(std::max<std::uint64_t>(farm_threads, 1));
  set_times(limits.unit_seconds, node_bytes(job), pace.bytes_per_second(), aim);
  if (const double seconds = job.record.spec.goal.seconds; seconds > 0) {
    // What is out when its time is up is waited for; results stay within what the coordinator takes.
    const double least = std::min(std::max(aim.unit_seconds / 2, 2 * aim.least_seconds), aim.unit_seconds);
    aim.unit_seconds = std::clamp(seconds - job.active_seconds(now), least, aim.unit_seconds);
  }
  aim.unit_seconds *= worker.unit_scale;
  aim.seconds_per_pixel_sample = measured ? known->second.costly_tile.value() : job.costly_tile.value();
  aim.threads = worker.hello.threads;
  const Result<MethodSpec> method = parse_method(job.record.spec.settings.method);
  aim.shared_samples = method.ok() ? shared_samples(*method) : 0;
  return aim;
}

bool Coordinator::State::serve_once(Worker& worker, Time now, Step& step) {
  if (!wants_more(worker)) {
    idle.erase(worker.hello.name);
    return false;
  }
  const bool granted = held.empty() && grant_next(worker, now, step);
  if (!granted) {
    idle.insert(worker.hello.name);
  }
  return granted;
}

void Coordinator::State::serve(Worker& worker, Time now, Step& step) {
  while (serve_once(worker, now, step)) {
  }
}

void Coordinator::State::serve_all(Time now, Step& step) {
  if (queue.empty()) {
    return;
  }
  // One lease each, then the next: what there is is spread over all that wait.
  std::vector<std::string> waiting(idle.begin(), idle.end());
  while (!waiting.empty() && !queue.empty()) {
    std::erase_if(waiting, [&](const std::string& name) {
      Worker* const worker = find_worker(name);
      return worker == nullptr || !serve_once(*worker, now, step);
    });
  }
}

bool Coordinator::State::grant_next(Worker& worker, Time now, Step& step) {
  for (auto at = queue.begin(); at != queue.end();) {
    Job& job = *jobs.at(at->job);
    ++at;  // what follows may move or remove the job's entry
    close_if_time_is_up(job, now, step);
    if (!queue.contains(job.id()) || now < job.hold_until || !may_render(worker, job)) {
      continue;
    }
    if (job.undecided()) {
      if (job.leases.empty() && job.plan->has_work() && may_pilot(worker, job, now)) {
        if (is_suspect(job.suspicion_of_pilot) && !worker.leases.empty()) {
          return false;  // as below
        }
        grant_pilot(worker, job, now, step);
        return true;
      }
      continue;
    }
    const bool has_work = job.plan->has_work();
    // The first picture comes first; after it, the sooner a liar is found, the less has to be rendered again.
    if (!(has_work && job.plan->first_round()) && grant_verification(worker, job, now, step)) {
      return true;
    }
    if (!has_work) {
      continue;
    }
    if (enough_is_tried(job)) {
      continue;
    }
    const bool alone = job.plan->next_is_alone();
    if (alone && !worker.leases.empty()) {
      return false;  // when it has nothing else, which others must not fill up
    }
    const LeaseId id = next_lease_id();
    const UnitAim aim = aim_for(worker, job, now);
    pace.gave(from_seconds(std::max(limits.unit_seconds, 2 * aim.results_seconds)));
    std::optional<Unit> unit = job.plan->take(job.id(), id, aim);
    if (!unit) {
      refresh_queue(job);
      continue;
    }
    if (job.record.fingerprint_class.empty()) {
      start_job(job, worker, step);
    }
    Lease& lease = open_lease(worker, job, id, *std::move(unit), false, now);
    lease.alone = alone;
    send_grant(worker, job, lease, step);
    refresh_queue(job);
    return true;
  }
  return false;
}

Lease& Coordinator::State::open_lease(Worker& worker, Job& job, LeaseId id, Unit unit, bool copy, Time now) {
  Lease& lease = leases[id];
  lease.id = id;
  lease.worker = worker.hello.name;
  lease.worker_since = worker.connected_at;
  lease.unit = std::move(unit);
  lease.done.assign(lease.unit.tiles.size(), false);
  lease.remaining = static_cast<std::uint32_t>(lease.unit.tiles.size());
  lease.granted = now;
  lease.copy = copy;
  lease.deadline = now + limits.lease_duration;
  expiry.insert({lease.deadline, id});
  if (!job.active_since && !job.undecided()) {
    job.active_since = now;
  }
  ++job.leases_sent;
  ++totals.units_leased;
  job.leases.insert(id);
  worker.leases.insert(id);
  worker.tiles_out += lease.remaining;
  ++worker.jobs[job.id()].leases;
  return lease;
}

void Coordinator::State::send_grant(Worker& worker, Job& job, Lease& lease, Step& step) {
  // Before the job's class is known to be stored, leases wait for the commit that stores it, and so do those that
  // follow them to the same worker, lest they overtake the description. Where a goal in error decides how many samples
  // there are, leases wait for the commit of what it was read from: no crash lets samples come back that are not
  // decided yet.
  WorkerJob& known = worker.jobs[job.id()];
  const bool count_is_fixed = job.record.spec.goal.error == 0;
  std::vector<Outgoing>& channel =
      count_is_fixed && job.digest_durable && (known.confirmed || known.leases == 1) ? step.now : step.after_commit;
  if (known.leases == 1 || known.describe) {
    channel.push_back({*worker.session, JobDescription{job.id(), job.digest, job.record.spec.settings}});
    known.describe = false;
  }
  channel.push_back({*worker.session, LeaseGrant{lease.id, lease.unit, trace_id(job.record.spec.request_id)}});
  if (&channel == &step.after_commit) {
    wait_until_sent(worker, job, lease);
  }
}

/// A store that is slow must not make workers look lost, nor blame what they never got.
void Coordinator::State::wait_until_sent(const Worker& worker, Job& job, Lease& lease) {
  lease.sent = false;
  lease.waits_for = *worker.session;
  set_deadline(lease, Time::max());
  if (--job.leases_sent == 0) {
    job.active_since.reset();  // nobody renders yet
  }
}

void Coordinator::State::was_sent(Lease& lease, Time now) {
  if (lease.sent) {
    return;
  }
  Job& job = *jobs.at(lease.unit.job);
  if (!job.active_since && !job.undecided()) {
    job.active_since = now;
  }
  ++job.leases_sent;
  lease.sent = true;
  lease.granted = now;
  renew(lease, now);
}

void Coordinator::grants_sent(std::span<const LeaseId> leases, Time now) {
  for (const LeaseId id : leases) {
    const auto found = state_->leases.find(id);
    // Whose stream has broken got nothing.
    if (found != state_->leases.end() && state_->workers.at(found->second.worker).session == found->second.waits_for) {
      state_->was_sent(found->second, now);
    }
  }
}

std::vector<LeaseId> leases_granted(std::span<const Outgoing> messages) {
  std::vector<LeaseId> leases;
  for (const Outgoing& each : messages) {
    if (const auto* grant = std::get_if<LeaseGrant>(&each.message)) {
      leases.push_back(grant->lease);
    } else if (const auto* pilot = std::get_if<PilotGrant>(&each.message)) {
      leases.push_back(pilot->lease);
    }
  }
  return leases;
}

void Coordinator::State::tile_done(LeaseId id, TileId tile, Time now, Step& step, bool by_its_worker) {
  const auto found = leases.find(id);
  if (found == leases.end()) {
    return;
  }
  Lease& lease = found->second;
  const std::size_t index = index_of(lease, tile);
  if (index == lease.done.size() || lease.done[index]) {
    return;
  }
  lease.done[index] = true;
  --lease.remaining;
  Worker& worker = workers.at(lease.worker);
  if (!by_its_worker) {
    note_silence(worker, lease, now);
  }
  --worker.tiles_out;
  if (lease.remaining == 0) {
    worker.unit_scale = std::min(worker.unit_scale * 2, 1.0);
    end_lease(id, !by_its_worker, false, now, step);
  }
}

void Coordinator::State::settle(Job& job, const NodeKey& merged, std::optional<LeaseId> from, Time now, Step& step) {
  for (const JobPlan::Hold& hold : job.plan->settle(merged.tile, merged.range)) {
    tile_done(hold.lease, hold.tile, now, step, from == hold.lease);
  }
}

void Coordinator::State::end_lease(LeaseId id, bool cancel, bool lost, Time now, Step& step) {
  const auto found = leases.find(id);
  LM_CHECK(found != leases.end());
  const Lease lease = std::move(found->second);
  lost = lost && lease.sent;  // nobody loses what nobody got
  leases.erase(found);
  expiry.erase({lease.deadline, id});
  Job& job = *jobs.at(lease.unit.job);
  Worker& worker = workers.at(lease.worker);

  for (std::size_t i = 0; i < lease.unit.tiles.size(); ++i) {
    if (!lease.done[i] && lease.verifies) {
      job.verifications.release({lease.unit.range, lease.unit.tiles[i]}, id, lost);
    } else if (!lease.done[i]) {
      job.plan->release(id, lease.unit.tiles[i], lease.unit.range);
    }
  }
  worker.tiles_out -= lease.remaining;
  worker.leases.erase(id);
  --worker.jobs[job.id()].leases;
  job.leases.erase(id);
  job.leases_sent -= lease.sent ? 1 : 0;
  if (job.leases_sent == 0) {  // all of them are pilots, or none
    job.record.active_seconds = job.active_seconds(now);
    job.active_since.reset();
  }
  if (lost) {
    ++worker.leases_lost;
    ++job.record.counters.leases_lost;
    ++totals.units_lost;
    ++job.version;
    if (lease.unit.tiles.empty()) {
      hold_pilots_back(worker, now);
    } else {
      worker.unit_scale = std::max(worker.unit_scale / 2, kLeastUnitScale);
    }
    note(step, Note::Level::warning, about(job.id(), lease.worker, id),
         "worker {} lost lease {}: job {}, {} goes out again", lease.worker, id.value, job.id().value,
         lease.unit.tiles.empty() ? std::string("its pilot")
                                  : fmt::format("samples [{}, {}) of {}", lease.unit.range.first(),
                                                lease.unit.range.end(), counted(lease.remaining, "tile")));
  }
  if (cancel && worker.session) {
    send_after_commit(step, *worker.session, LeaseCancel{{id}});
  }
  if (wants_more(worker)) {
    idle.insert(lease.worker);  // whoever serves next need not wait for a word from it
  }
  refresh_queue(job);
}

void Coordinator::State::end_lease_of_lost(LeaseId id, bool cancel, Time now, Step& step) {
  const Lease lease = leases.at(id);
  Job& job = *jobs.at(lease.unit.job);
  end_lease(id, cancel, true, now, step);
  put_progress(job, now, step);
  if (std::string reason = suspect(job, lease); !reason.empty()) {
    finish_job(job, JobState::failed, std::move(reason), now, step);
  }
  finish_if_complete(job, now, step);
}

std::string Coordinator::State::suspect(Job& job, const Lease& lost) const {
  if (lost.verifies || !lost.sent) {
    return "";  // somebody has rendered it before, or nobody got it
  }
  if (const auto worker = workers.find(lost.worker); worker != workers.end() && worker->second.bad_results > 0) {
    return "";  // it sends damaged results: what it loses says nothing about the tile
  }
  std::string reason;
  const auto count = [&](Suspicion& suspicion, const auto& describe) {
    const std::pair worker(lost.worker, lost.worker_since);
    if (std::exchange(suspicion.last, worker) == worker) {
      return;
    }
    ++suspicion.lost;
    if (lost.alone) {
      suspicion.alone.push_back(lost.worker);
    }
    if (suspicion.alone.size() >= limits.losses_alone) {
      reason = fmt::format("{} workers were lost in a row, the last ones ({}) while they had nothing to do but {}",
                           suspicion.lost, fmt::join(suspicion.alone, ", "), describe());
    }
  };
  if (lost.unit.tiles.empty()) {
    count(job.suspicion_of_pilot, [] { return std::string("to try the job's methods"); });
  }
  for (std::size_t i = 0; i < lost.unit.tiles.size(); ++i) {
    if (lost.done[i]) {
      continue;
    }
    const TileId tile = lost.unit.tiles[i];
    Suspicion& suspicion = job.suspicions[tile];
    count(suspicion, [&] {
      const PixelRect rect = job.film.grid().tile_rect(tile);
      return fmt::format("to render samples [{}, {}) of the {}x{} pixels at {}, {}", lost.unit.range.first(),
                         lost.unit.range.end(), rect.width, rect.height, rect.x, rect.y);
    });
    if (is_suspect(suspicion)) {
      job.plan->set_alone(tile, true);
    }
  }
  return reason;
}

void Coordinator::State::set_deadline(Lease& lease, Time deadline) {
  expiry.erase({lease.deadline, lease.id});
  lease.deadline = deadline;
  if (deadline != Time::max()) {
    expiry.insert({lease.deadline, lease.id});
  }
}

void Coordinator::State::renew(Lease& lease, Time now) {
  if (lease.sent) {
    set_deadline(lease, now + limits.lease_duration);
  }
}

void Coordinator::State::expire(Time now, Step& step) {
  while (!expiry.empty() && expiry.begin()->first <= now) {
    const LeaseId id = expiry.begin()->second;
    Lease& lease = leases.at(id);
    if (!lease.abandoned && behind_at + limits.lease_duration > now) {
      set_deadline(lease, behind_at + limits.lease_duration);
      continue;
    }
    const std::string name = lease.worker;
    end_lease_of_lost(id, true, now, step);
    if (Worker* worker = find_worker(name)) {
      worker->silent = true;
      idle.erase(name);
    }
    forget_if_gone(name, step);
  }
}

}  // namespace lightmill
