#include "server/domain/sessions.h"

#include "common/base/check.h"
#include "common/base/number_text.h"
#include "common/base/text.h"
#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

/// Most threads of one worker.
constexpr std::uint32_t kMaxThreads = 4096;
/// Leases that a hello may list. An honest worker has at most 16.
constexpr std::size_t kMaxHeld = 1'000;
/// Of all workers together, if all had the interval of the newest one.
constexpr int kHeartbeatsPerSecond = 500;

/// Each once.
bool are_ascending(const std::vector<TileId>& tiles) {
  return std::ranges::adjacent_find(tiles, std::ranges::greater_equal()) == tiles.end();
}

Status check_hello(const WorkerHello& hello) {
  if (hello.name.empty() || hello.threads < 1 || hello.threads > kMaxThreads) {
    return invalid_argument("a worker must have a name and 1 to {} threads, got '{}' with {}", kMaxThreads,
                            as_name(hello.name), hello.threads);
  }
  LM_RETURN_IF_ERROR(check_name("the worker's name", hello.name));
  LM_RETURN_IF_ERROR(check_name("the worker's host", hello.host));
  LM_RETURN_IF_ERROR(check_name("the worker's machine", hello.machine));
  LM_RETURN_IF_ERROR(check_name("the worker's fingerprint class", hello.fingerprint_class));
  if (hello.fingerprint_class == kMixedClass) {
    return invalid_argument("the worker's fingerprint class must not be '{}': the name is reserved", kMixedClass);
  }
  return check_name("the worker's renderer version", hello.renderer_version);
}

}  // namespace

// ---- connecting ----

Duration Sessions::heartbeat_interval() const {
  const Duration of_all = Duration(std::chrono::seconds(1)) * workers_.sessions() / kHeartbeatsPerSecond;
  return std::max(limits_.heartbeat_interval,
                  std::min<Duration>({of_all, limits_.lease_duration / 4, limits_.silence / 4}));
}

void Sessions::connect(SessionId session, const WorkerHello& hello, const Event& event) {
  LM_CHECK(workers_.find_session(session) == nullptr, "session {} said hello twice", session.value);
  workers_.open_session(session, hello, event.now);
  if (const Status status = check_hello(hello); !status.ok()) {
    dismissals_.dismiss(session, message_of(status), event);
    return;
  }
  if (workers_.is_full(hello.name)) {
    dismissals_.dismiss(
        session,
        fmt::format("the farm is full: it takes {} workers (--max-workers). Try again later", limits_.max_workers),
        event, true);
    return;
  }
  if (const Worker* const known = workers_.find(hello.name); known != nullptr && known->session()) {
    // If two processes have one name, the connected one keeps it. Else they would take it from each other forever.
    const bool alive = event.now < known->last_message() + limits_.lease_duration;
    if (alive && !known->draining() && !same_process(known->hello(), hello)) {
      dismissals_.dismiss(
          session,
          fmt::format("another worker named {} is connected (process {} on {}). Choose another --name, or leave it "
                      "out for one that is unique",
                      hello.name, known->hello().pid, known->hello().host),
          event);
      return;
    }
    dismissals_.dismiss(*known->session(), fmt::format("another worker connected with the name {}", hello.name), event);
  }
  const bool quarantined =
      quarantine_.contains({hello.name, identity_of(hello)}, hello.identity.empty() ? hello.host : "");
  const bool other_process = workers_.connect(session, hello, quarantined, event.now);
  Worker& worker = workers_.at(hello.name);
  event.info(about(hello.name), "worker {} connected: {} on {}, class {}", hello.name, counted(hello.threads, "thread"),
             hello.host, hello.fingerprint_class);
  event.send(session,
             Welcome{leases_.epoch(), heartbeat_interval(), limits_.lease_duration, signer_.farm(), hello.name});
  if (quarantined) {
    event.send(session, Notice{"this worker is in quarantine, and gets no work until an operator releases it"});
  }
  worker.waits_from(leases_.last_id());
  const std::optional<LeaseId> forged = take_back_held(worker, hello, other_process, event);
  scheduler_.serve_all(event);  // workers that waited before get the work that this one lost
  if (forged) {
    // Counts once for each hello, and not for the identity. Honest workers of one machine may bring leases of another
    // farm that had this address before.
    event.warn(about(JobId{}, hello.name, *forged),
               "worker {} claims lease {}, which was never granted to it under this name", hello.name, forged->value);
    dismissals_.count_violation(
        session, worker.count_bad_result(),
        make_error(StatusCode::kPermissionDenied, "leases that were never granted to this worker"), event);
  } else {
    scheduler_.serve(worker, event);
  }
  inspections_.serve(event);
}

std::optional<LeaseId> Sessions::take_back_held(Worker& worker, const WorkerHello& hello, bool other_process,
                                                const Event& event) {
  LeaseCancel unwanted;
  std::optional<LeaseId> forged;
  std::set<LeaseId> kept;
  std::size_t tried = 0;
  for (const HeldLease& held : hello.held) {
    if (kept.contains(held.lease)) {
      continue;
    }
    const Adoption adopted = ++tried <= kMaxHeld ? adopt(worker, held, event) : Adoption::unwanted;
    if (adopted == Adoption::adopted) {
      kept.insert(held.lease);
    } else {
      unwanted.leases.push_back(held.lease);
    }
    if (adopted == Adoption::forged) {
      forged = held.lease;
    }
  }
  // The table may have leases of this name that the worker does not hold. It does not render them.
  for (const LeaseId id : std::set(worker.leases())) {
    if (!worker.leases().contains(id) || kept.contains(id)) {
      continue;
    }
    if (other_process) {
      life_cycle_.lose_lease(id, false, event);
    } else {
      const Lease ended = leases_.at(id);
      const bool worked_on = leases_.is_worked_on(ended);
      life_cycle_.end_lease(id, {.lost = true}, event);
      if (worked_on) {
        life_cycle_.given_back(ended, event);
      }
    }
  }
  if (!unwanted.leases.empty()) {
    event.send_after_commit(*worker.session(), std::move(unwanted));
  }
  return forged;
}

Sessions::Adoption Sessions::adopt(Worker& worker, const HeldLease& held, const Event& event) {
  Job* const job = jobs_.find(held.unit.job);
  if (job == nullptr || !job->active() || job->undecided() || job->digest() != held.render_digest ||
      !may_render(worker, *job)) {
    return Adoption::unwanted;
  }
  const std::vector<TileId>& tiles = held.unit.tiles;
  if (tiles.empty() || tiles.size() != held.tags.size() || !are_ascending(tiles)) {
    return Adoption::unwanted;
  }
  // The first wrong tag decides. A worker has right tags only from its own grants.
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const NodeKey key{held.unit.job, tiles[i], held.unit.range};
    if (!signer_.verify(held.tags[i], worker.name(), held.lease, held.render_digest, key)) {
      return Adoption::forged;
    }
  }
  if (const Lease* const lease = leases_.find(held.lease)) {
    if (lease->worker != worker.name() || lease->unit.job != held.unit.job || lease->unit.range != held.unit.range) {
      return Adoption::unwanted;
    }
    leases_.resume(held.lease, event.now);
    for (const TileId tile : std::vector(lease->unit.tiles)) {
      // The worker saw this tile acknowledged, or never got it. If the film does not have it, it is free again.
      if (!std::binary_search(tiles.begin(), tiles.end(), tile)) {
        leases_.give_up_tile(held.lease, tile, event);
      }
    }
    queue_.refresh(*job);
    if (leases_.find(held.lease) == nullptr) {
      return Adoption::unwanted;
    }
  } else if (held.lease > leases_.last_id()) {
    return Adoption::unwanted;  // the id is not used yet, and another lease will get it
  } else {
    // The lease is from an earlier coordinator, or was taken for lost. The worker resumes the tiles that are still
    // free. Suspect tiles go to a worker alone.
    Unit unit{held.unit.job, held.unit.range, {}};
    for (const TileId tile : tiles) {
      if (!job->losses().is_suspect(tile) && job->plan().adopt(held.lease, tile, held.unit.range)) {
        unit.tiles.push_back(tile);
      }
    }
    if (unit.tiles.empty()) {
      return Adoption::unwanted;
    }
    leases_.open(worker, *job, {.id = held.lease, .unit = std::move(unit)}, event.now);
    queue_.refresh(*job);
  }
  WorkerJob& known = worker.job(job->id());
  known.describe = false;
  known.confirmed = true;
  job->came_back(held.lease);
  return Adoption::adopted;
}

// ---- messages of workers ----

void Sessions::heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event) {
  if (heartbeat.longest_wait) {
    worker.waits(*heartbeat.longest_wait, event.now);
  }
  scheduler_.update_result_rate(event);
  LeaseCancel unknown;
  for (const LeaseId id : heartbeat.leases) {
    if (const Lease* const lease = leases_.find(id); lease != nullptr && lease->worker == worker.name()) {
      leases_.renew(id, event.now);
    } else {
      unknown.leases.push_back(id);
    }
  }
  if (!unknown.leases.empty()) {
    event.send_after_commit(*worker.session(), std::move(unknown));
  }
}

void Sessions::give_back(Worker& worker, const WorkerReturn& message, const Event& event) {
  const Lease* const lease = leases_.find(message.lease);
  if (lease == nullptr || lease->worker != worker.name()) {
    return;
  }
  Job& job = jobs_.at(lease->unit.job);
  worker.job(job.id()).describe = true;
  const Lease ended = *lease;
  const bool worked_on = leases_.is_worked_on(ended);
  leases_.end(message.lease, {}, event);
  if (worked_on) {
    life_cycle_.given_back(ended, event);
  }
  life_cycle_.finish_if_complete(job, event);
  scheduler_.serve_all(event);
  scheduler_.serve(worker, event);
}

void Sessions::refuse(Worker& worker, const WorkerRefusal& refusal, const Event& event) {
  Job* const job = jobs_.find(refusal.job);
  if (job == nullptr || !job->active() || !may_render(worker, *job) || worker.find_job(refusal.job) == nullptr) {
    return;
  }
  const std::string reason = printable(refusal.reason);
  event.warn(about(job->id(), worker.name()), "worker {} {} job {}{}: {}", worker.name(),
             refusal.own_limits ? "leaves" : "refuses", job->id().value, refusal.own_limits ? " to others" : "",
             reason);
  if (refusal.own_limits) {
    worker.exclude(job->id(), reason);
    job->left_to_others(worker.identity(), event.now);
  } else {
    job->refused(worker.identity(), worker.name(), reason, Refusals::Cause::claim);
  }
  life_cycle_.withdraw(*job, worker, event);
  scheduler_.serve_all(event);
  scheduler_.serve(worker, event);
}

// ---- ends of sessions ----

void Sessions::leaves(Worker& worker, const Event& event) {
  if (!worker.draining()) {
    workers_.drain(worker);
    event.info(about(worker.name()), "worker {} drains", worker.name());
  }
  inspections_.left(*worker.session(), false, event);
}

Status Sessions::drain(const std::string& name, const Event& event) {
  Worker* const worker = workers_.find(name);
  if (worker == nullptr || !worker->session()) {
    return not_found("there is no worker '{}'", name);
  }
  if (!worker->draining()) {
    workers_.drain(*worker);
    event.info(about(name), "worker {} drains: an operator asked for it", name);
  }
  event.send_after_commit(*worker->session(), DrainRequest{});
  return ok_status();
}

void Sessions::disconnected(SessionId session, const Event& event) {
  if (const Worker* const worker = workers_.of(session)) {
    event.info(about(worker->name()), "worker {} disconnected with {}", worker->name(),
               counted(worker->leases().size(), "lease"));
  }
  end(session, event);
  inspections_.serve(event);
}

void Sessions::end(SessionId session, const Event& event) {
  inspections_.left(session, true, event);
  const WorkerRegistry::Session* const found = workers_.find_session(session);
  if (found == nullptr) {
    return;
  }
  const std::string name = found->worker;
  if (const Worker* const worker = workers_.close_session(session)) {
    leases_.abandon(*worker, event.now);
  }
  workers_.forget_if_gone(name, event);
}

void Sessions::end_silent(const Event& event) {
  if (const std::optional<Time> due = workers_.next_silence_check(); !due || event.now < *due) {
    return;
  }
  const std::vector<SessionId> silent = workers_.too_silent(event.now);
  for (const SessionId session : silent) {
    const Worker& worker = *workers_.of(session);
    event.warn(about(worker.name()), "worker {} disconnected with {}: no message for {:.0f} s", worker.name(),
               counted(worker.leases().size(), "lease"), to_seconds(event.now - worker.last_message()));
  }
  for (const SessionId session : silent) {
    end(session, event);
    event.effects.closed.push_back(session);
  }
  inspections_.serve(event);
}

}  // namespace lightmill
