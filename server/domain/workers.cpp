// How workers' sessions come, speak and go.
#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "common/base/quantities.h"
#include "common/base/text.h"
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// Threads that one worker may claim.
constexpr std::uint32_t kMaxThreads = 4096;
/// The log says so often at most that the farm is full.
constexpr Duration kFullNotePause = std::chrono::minutes(1);

Status check_hello(const WorkerHello& hello) {
  if (hello.name.empty() || hello.threads < 1 || hello.threads > kMaxThreads) {
    return invalid_argument("a worker has a name and 1 to {} threads, got '{}' with {}", kMaxThreads,
                            as_name(hello.name), hello.threads);
  }
  LM_RETURN_IF_ERROR(check_name("the worker's name", hello.name));
  LM_RETURN_IF_ERROR(check_name("the worker's host", hello.host));
  LM_RETURN_IF_ERROR(check_name("the worker's machine", hello.machine));
  LM_RETURN_IF_ERROR(check_name("the worker's fingerprint class", hello.fingerprint_class));
  if (hello.fingerprint_class == kMixedClass) {
    return invalid_argument("the worker's fingerprint class: '{}' stands for many", kMixedClass);
  }
  return check_name("the worker's renderer version", hello.renderer_version);
}

/// The process that is connected may come again, its stream broken in a way that nobody has noticed here yet. Of two
/// processes with one name the one at work keeps it, or they would take it from each other without end.
bool same_process(const WorkerHello& a, const WorkerHello& b) {
  return a.host == b.host && a.pid == b.pid;
}

}  // namespace

Worker* Coordinator::State::worker_of(SessionId session) {
  const auto found = sessions.find(session);
  if (found == sessions.end() || !found->second.current) {
    return nullptr;
  }
  return find_worker(found->second.worker);
}

void Coordinator::State::dismiss(SessionId session, std::string reason, Time now, Step& step, bool for_now) {
  Session& entry = sessions.at(session);
  if (!for_now) {
    note(step, Note::Level::warning, about(entry.worker), "worker {} is dismissed: {}", entry.worker, reason);
  } else if (now >= next_full_note) {  // it and others ask again and again
    next_full_note = now + kFullNotePause;
    note(step, Note::Level::warning, about(entry.worker), "worker {} finds no room: {}", entry.worker, reason);
  }
  send_after_commit(step, session, Dismissal{std::move(reason), for_now});
  if (Worker* const worker = worker_of(session)) {
    if (counts(*worker)) {
      farm_threads -= worker->hello.threads;
    }
    worker->session.reset();
    idle.erase(entry.worker);
  }
  entry.current = false;
  inspections.left(session, false, now, step);
}

void Coordinator::State::connect(SessionId session, const WorkerHello& hello, Time now, Step& step) {
  LM_CHECK(!sessions.contains(session), "session {} said hello twice", session.value);
  if (sessions.empty()) {
    next_silence_look = now + limits.silence;
  }
  sessions[session] = {as_name(hello.name), as_name(machine_of(hello)), as_name(hello.fingerprint_class), false};
  if (const Status status = check_hello(hello); !status.ok()) {
    dismiss(session, message_of(status), now, step);
    return;
  }
  if (!workers.contains(hello.name) && workers.size() >= limits.max_workers) {
    dismiss(session,
            fmt::format("the farm is full: it takes {} workers (--max-workers), and asks you to come again later",
                        limits.max_workers),
            now, step, true);
    return;
  }
  Worker& worker = workers[hello.name];
  if (worker.session) {
    const bool heard = now < worker.heard_at + limits.lease_duration;
    if (heard && !worker.draining && !same_process(worker.hello, hello)) {
      dismiss(session,
              fmt::format("another worker named {} is connected (process {} on {}); choose another --name, or leave it "
                          "out for one that is unique",
                          hello.name, worker.hello.pid, worker.hello.host),
              now, step);
      return;
    }
    dismiss(*worker.session, fmt::format("another worker came with the name {}", hello.name), now, step);
  }
  worker.heard_at = now;
  sessions[session].current = true;
  const bool other_process = !same_process(worker.hello, hello);
  if (other_process) {
    worker.bad_results = 0;
    worker.too_large.clear();
  }
  worker.hello = hello;
  worker.hello.held.clear();
  worker.session = session;
  worker.connected_at = now;
  worker.draining = hello.draining;
  worker.silent = false;
  worker.wait.reset();
  worker.quarantined = in_quarantine(renderer_of(hello));
  absent.erase(machine_of(hello));
  worker.jobs.clear();
  for (const LeaseId id : worker.leases) {
    ++worker.jobs[leases.at(id).unit.job].leases;
  }
  if (counts(worker)) {
    farm_threads += hello.threads;
  }
  note(step, Note::Level::info, about(hello.name), "worker {} is here: {} on {}, class {}", hello.name,
       counted(hello.threads, "thread"), hello.host, hello.fingerprint_class);
  send(step, session, Welcome{epoch, heartbeat_interval(), limits.lease_duration});
  if (worker.quarantined) {
    send(step, session, Notice{"in quarantine, this worker gets nothing to render until it is released"});
  }
  take_back_held(worker, hello, other_process, now, step);
  serve(worker, now, step);
  serve_all(now, step);
  serve_inspections(now, step);
}

void Coordinator::State::take_back_held(Worker& worker, const WorkerHello& hello, bool other_process, Time now,
                                        Step& step) {
  LeaseCancel unwanted;
  std::set<LeaseId> kept;
  for (const HeldLease& held : hello.held) {
    if (adopt_held(worker, held, now, step)) {
      kept.insert(held.lease);
    } else {
      unwanted.leases.push_back(held.lease);
    }
  }
  // What was given under this name and is not held any more is not being worked on.
  const std::set<LeaseId> before = worker.leases;
  for (const LeaseId id : before) {
    if (!worker.leases.contains(id) || kept.contains(id)) {
      continue;
    }
    if (other_process) {
      end_lease_of_lost(id, false, now, step);
      continue;
    }
    Job& job = *jobs.at(leases.at(id).unit.job);
    end_lease(id, false, true, now, step);
    put_progress(job, now, step);
    finish_if_complete(job, now, step);
  }
  if (!unwanted.leases.empty()) {
    send_after_commit(step, *worker.session, std::move(unwanted));
  }
}

bool Coordinator::State::adopt_held(Worker& worker, const HeldLease& held, Time now, Step& step) {
  Job* const job = find_job(held.unit.job);
  if (job == nullptr || !job->active() || job->undecided() || job->digest != held.render_digest ||
      held.unit.tiles.empty() || !may_render(worker, *job)) {
    return false;
  }
  std::vector<TileId> tiles = held.unit.tiles;
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  if (const auto found = leases.find(held.lease); found != leases.end()) {
    Lease& lease = found->second;
    if (lease.worker != worker.hello.name || lease.unit.job != held.unit.job || lease.unit.range != held.unit.range) {
      return false;
    }
    lease.abandoned = false;
    was_sent(lease, now);
    renew(lease, now);
    const std::vector<TileId> leased = lease.unit.tiles;
    const SampleRange range = lease.unit.range;
    for (const TileId tile : leased) {
      // The worker has seen this tile acknowledged or never got it; if it is not covered, somebody must render it.
      if (!std::binary_search(tiles.begin(), tiles.end(), tile)) {
        end_verification_of(held.lease, tile, now, step);
        job->plan->release(held.lease, tile, range);
        tile_done(held.lease, tile, now, step, true);
      }
    }
    refresh_queue(*job);
    if (!leases.contains(held.lease)) {
      return false;
    }
  } else if (held.lease.value > (epoch << 32 | lease_count)) {
    return false;  // nobody has given it yet: its number will be another lease's
  } else {
    // An earlier coordinator, or this one before it took the lease for lost, gave it: go on with what is still free.
    Unit unit{held.unit.job, held.unit.range, {}};
    for (const TileId tile : tiles) {
      if (job->plan->adopt(held.lease, tile, held.unit.range)) {
        unit.tiles.push_back(tile);
      }
    }
    if (unit.tiles.empty()) {
      return false;
    }
    open_lease(worker, *job, held.lease, std::move(unit), false, now);
    refresh_queue(*job);
  }
  WorkerJob& known = worker.jobs[job->id()];
  known.describe = false;
  known.confirmed = true;
  job->digest_durable = job->digest_durable || job->bound_before(held.lease);
  return true;
}

void Coordinator::State::on_return(Worker& worker, const WorkerReturn& message, Time now, Step& step) {
  const auto found = leases.find(message.lease);
  if (found == leases.end() || found->second.worker != worker.hello.name) {
    return;
  }
  Job& job = *jobs.at(found->second.unit.job);
  worker.jobs[job.id()].describe = true;
  end_lease(message.lease, false, false, now, step);
  finish_if_complete(job, now, step);
  serve_all(now, step);
  serve(worker, now, step);
}

void Coordinator::State::on_refusal(Worker& worker, const WorkerRefusal& refusal, Time now, Step& step) {
  Job* const job = find_job(refusal.job);
  if (job == nullptr || !job->active() || !may_render(worker, *job) || !worker.jobs.contains(refusal.job)) {
    return;
  }
  if (refusal.own_limits) {
    exclude(worker, *job, refusal.reason, now, step);
  } else {
    finish_job(*job, JobState::failed, fmt::format("worker {}: {}", worker.hello.name, refusal.reason), now, step);
  }
  serve_all(now, step);
  serve(worker, now, step);
}

void Coordinator::State::exclude(Worker& worker, Job& job, const std::string& reason, Time now, Step& step) {
  worker.too_large[job.id()] = printable(reason);
  note(step, Note::Level::warning, about(job.id(), worker.hello.name), "worker {} leaves job {} to others: {}",
       worker.hello.name, job.id().value, worker.too_large.at(job.id()));
  const std::set<LeaseId> held = worker.leases;
  for (const LeaseId id : held) {
    if (leases.at(id).unit.job == job.id()) {
      end_lease(id, false, false, now, step);
    }
  }
  if (job.leases.empty() && job.film.pixel_samples() == 0) {
    give_back_seconds(job, 0, now);  // nothing has been rendered in them
  }
  put_progress(job, now, step);
  const bool wanted = std::ranges::any_of(
      workers, [&](const auto& entry) { return counts(entry.second) && may_render(entry.second, job); });
  if (!wanted && job.leases.empty() && job.film.pixel_samples() == 0 && job.record.state == JobState::running) {
    unbind(job, step);  // its class was that of workers for which it is too large
  }
  finish_if_complete(job, now, step);
}

void Coordinator::State::end_session(SessionId session, Time now, Step& step) {
  inspections.left(session, true, now, step);
  const auto found = sessions.find(session);
  if (found == sessions.end()) {
    return;
  }
  const std::string name = found->second.worker;
  if (Worker* const worker = worker_of(session)) {
    if (counts(*worker)) {
      farm_threads -= worker->hello.threads;
    }
    if (!worker->draining) {
      absent[machine_of(worker->hello)] = {worker->heard_at, worker->hello.fingerprint_class,
                                           worker->hello.renderer_version};
    }
    worker->session.reset();
    idle.erase(name);
    for (const LeaseId id : worker->leases) {
      Lease& lease = leases.at(id);
      lease.abandoned = true;
      set_deadline(lease, std::min(lease.deadline, now + limits.disconnect_grace));
    }
  }
  sessions.erase(found);
  forget_if_gone(name, step);
}

void Coordinator::State::forget_if_gone(const std::string& name, Step& step) {
  const auto found = workers.find(name);
  if (found != workers.end() && !found->second.session && found->second.leases.empty()) {
    idle.erase(name);
    step.departed.push_back(count_of(found->second));
    workers.erase(found);
  }
}

// ---- the class ----

void Coordinator::worker_connected(SessionId session, const WorkerHello& hello, Time now, Step& step) {
  state_->saw_clock(now, state_->unix_ms(now), step);
  state_->connect(session, hello, now, step);
}

void Coordinator::worker_message(SessionId session, WorkerMessage message, Time now, std::int64_t unix_ms, Step& step) {
  State& state = *state_;
  state.saw_clock(now, unix_ms, step);
  if (!state.sessions.contains(session)) {
    return;
  }
  bool may_read_again = false;
  if (Worker* const worker = state.worker_of(session)) {
    worker->heard_at = now;
    if (std::holds_alternative<WorkerResult>(message)) {
      worker->result_at = now;
    }
    if (worker->silent) {
      worker->silent = false;
      may_read_again = true;
      state.idle.insert(worker->hello.name);
    }
  }
  if (auto* result = std::get_if<WorkerResult>(&message)) {
    state.on_result(session, std::move(*result), now, step);
    return;
  }
  Worker* const worker = state.worker_of(session);
  if (worker == nullptr) {
    return;
  }
  std::visit(Overloaded{
                 [&](const WorkerHeartbeat& heartbeat) { state.on_heartbeat(*worker, heartbeat, now, step); },
                 [&](const WorkerReturn& lease) { state.on_return(*worker, lease, now, step); },
                 [&](const PilotReport& report) { state.on_pilot(*worker, report, now, step); },
                 [&](const WorkerRefusal& refusal) { state.on_refusal(*worker, refusal, now, step); },
                 [&](const InspectReport& report) {
                   state.inspections.report(session, report, step);
                   may_read_again = true;
                 },
                 [&](const WorkerDraining&) {
                   if (!worker->draining) {
                     state.farm_threads -= State::counts(*worker) ? worker->hello.threads : 0;
                     worker->draining = true;
                     state.idle.erase(worker->hello.name);
                     note(step, Note::Level::info, about(worker->hello.name), "worker {} is leaving",
                          worker->hello.name);
                   }
                   state.inspections.left(session, false, now, step);
                   may_read_again = true;
                 },
                 [](const auto&) {},  // a second hello says nothing new; results are handled above
             },
             message);
  if (may_read_again) {
    state.serve_inspections(now, step);
  }
}

void Coordinator::cannot_keep_up(Time now) {
  state_->behind_at = now;
}

void Coordinator::worker_disconnected(SessionId session, Time now, Step& step) {
  if (const Worker* const worker = state_->worker_of(session)) {
    note(step, Note::Level::info, about(worker->hello.name), "worker {} is gone with {}", worker->hello.name,
         counted(worker->leases.size(), "lease"));
  }
  state_->end_session(session, now, step);
  state_->serve_inspections(now, step);
}

Status Coordinator::drain_worker(const std::string& name, Time now, Step& step) {
  (void)now;
  Worker* const worker = state_->find_worker(name);
  if (worker == nullptr || !worker->session) {
    return not_found("there is no worker '{}'", name);
  }
  if (!worker->draining) {
    state_->farm_threads -= State::counts(*worker) ? worker->hello.threads : 0;
    worker->draining = true;
    state_->idle.erase(name);
    note(step, Note::Level::info, about(name), "worker {} is asked to leave", name);
  }
  send_after_commit(step, *worker->session, DrainRequest{});
  return ok_status();
}

}  // namespace lightmill
