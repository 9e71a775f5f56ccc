#include "server/domain/worker_registry.h"

#include <algorithm>

#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr double kMinUnitScale = 1.0 / 64;
/// Most searches for silent workers per `silence`. Each search visits all workers.
constexpr int kSilenceChecks = 20;

}  // namespace

bool same_process(const WorkerHello& a, const WorkerHello& b) {
  return a.host == b.host && a.pid == b.pid;
}

WorkerCount Worker::count() const {
  return {hello_.name, hello_.threads, static_cast<std::uint32_t>(leases_.size()),
          results_,    leases_lost_,   pixel_samples_};
}

void Worker::lent(const Lease& lease) {
  leases_.insert(lease.id);
  waits_since_ = std::max(waits_since_, lease.id);
  tiles_out_ += lease.remaining;
  pilots_out_ += lease.is_pilot() ? 1 : 0;
  ++jobs_[lease.unit.job].leases;
}

void Worker::ended(const Lease& lease) {
  leases_.erase(lease.id);
  tiles_out_ -= lease.remaining;
  pilots_out_ -= lease.is_pilot() ? 1 : 0;
  --jobs_[lease.unit.job].leases;
}

void Worker::lost(const Lease& lease, Time now) {
  ++leases_lost_;
  if (!lease.is_pilot()) {
    unit_scale_ = std::max(unit_scale_ / 2, kMinUnitScale);
  } else {
    pilots_from_ = now + retry_delay(++pilots_lost_);  // the worker's next heartbeat after that serves it again
  }
}

const WorkerJob* Worker::find_job(JobId id) const {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : &found->second;
}

void Worker::waits(Duration wait, Time now) {
  wait_ = wait;
  wait_at_ = now;
}

void Worker::rendered(JobId job, double seconds, std::uint64_t pixel_samples, Time now) {
  jobs_[job].cost.add(seconds);
  rate_.add(static_cast<double>(pixel_samples), now);
  pixel_samples_ += pixel_samples;
}

// ---- counting ----

void WorkerRegistry::count(const Worker& worker) {
  const WorkerHello& hello = worker.hello_;
  threads_ += worker.threads_;
  claimed_threads_ += hello.threads;
  auto& identities = classes_[{hello.renderer_version, hello.fingerprint_class}];
  if (++identities[worker.identity()] == 1 && identities.size() == 2) {
    ++audited_classes_[hello.renderer_version];
  }
}

void WorkerRegistry::uncount(const Worker& worker) {
  const WorkerHello& hello = worker.hello_;
  threads_ -= worker.threads_;
  claimed_threads_ -= hello.threads;
  const auto of_class = classes_.find({hello.renderer_version, hello.fingerprint_class});
  const auto identity = of_class->second.find(worker.identity());
  if (--identity->second > 0) {
    return;
  }
  of_class->second.erase(identity);
  if (of_class->second.size() == 1 && --audited_classes_.at(hello.renderer_version) == 0) {
    audited_classes_.erase(hello.renderer_version);
  }
  if (of_class->second.empty()) {
    classes_.erase(of_class);
  }
}

std::uint32_t WorkerRegistry::count_bad_result(SessionId session, Time now) {
  Worker* const worker = of(session);
  const std::uint32_t own = worker == nullptr ? 1 : worker->count_bad_result();
  std::erase_if(bad_results_, [&](const auto& entry) { return now >= entry.second.last + kBadResultMemory; });
  const std::string& identity = find_session(session)->identity;
  if (bad_results_.size() >= limits_.max_workers && !bad_results_.contains(identity)) {
    return own;  // without authentication, a liar can claim any number of machines
  }
  BadResults& bad = bad_results_[identity];
  bad.last = now;
  return std::max(++bad.count, own);
}

void WorkerRegistry::delivered(Worker& worker, JobId job, std::uint64_t pixel_samples, Time now) {
  WorkerJob& known = worker.jobs_[job];
  known.delivered = true;
  known.delivered_samples.add(static_cast<double>(pixel_samples), now);
  if (++worker.delivered_ > worker.threads_ && worker.threads_ < worker.hello_.threads) {
    ++worker.threads_;
    threads_ += worker.counts() ? 1 : 0;
  }
}

std::size_t WorkerRegistry::identities_like(const Worker& worker) const {
  const auto found = classes_.find({worker.hello().renderer_version, worker.hello().fingerprint_class});
  return found == classes_.end() ? 0 : found->second.size();
}

bool WorkerRegistry::any_can_audit(const std::string& renderer_version) const {
  return audited_classes_.contains(renderer_version);
}

Worker* WorkerRegistry::find(const std::string& name) {
  const auto found = workers_.find(name);
  return found == workers_.end() ? nullptr : &found->second;
}

const Worker* WorkerRegistry::find(const std::string& name) const {
  const auto found = workers_.find(name);
  return found == workers_.end() ? nullptr : &found->second;
}

// ---- sessions ----

const WorkerRegistry::Session* WorkerRegistry::find_session(SessionId session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? nullptr : &found->second;
}

Worker* WorkerRegistry::of(SessionId session) {
  const Session* const found = find_session(session);
  return found == nullptr || !found->current ? nullptr : find(found->worker);
}

void WorkerRegistry::open_session(SessionId session, const WorkerHello& hello, Time now) {
  if (sessions_.empty()) {
    next_silence_check_ = now + limits_.silence;
  }
  sessions_[session] = {as_name(hello.name), as_name(identity_of(hello)), as_name(hello.fingerprint_class), false};
}

bool WorkerRegistry::is_full(const std::string& name) const {
  return !workers_.contains(name) && workers_.size() >= limits_.max_workers;
}

bool WorkerRegistry::connect(SessionId session, const WorkerHello& hello, bool quarantined, Time now) {
  sessions_.at(session).current = true;
  Worker& worker = workers_[hello.name];
  const bool other_process = !same_process(worker.hello_, hello);
  change(worker, [&] {
    if (other_process) {
      worker.bad_results_ = 0;
      worker.too_large_.clear();
    }
    worker.hello_ = hello;
    worker.hello_.held.clear();
    worker.threads_ = std::min(hello.threads, limits_.threads_at_first);
    worker.delivered_ = 0;
    worker.session_ = session;
    worker.connected_at_ = worker.last_message_ = now;
    worker.draining_ = hello.draining;
    worker.silent_ = false;
    worker.quarantined_ = quarantined;
    worker.wait_.reset();
    std::erase_if(worker.jobs_, [](const auto& entry) { return entry.second.leases == 0; });
    for (auto& [id, job] : worker.jobs_) {
      job = WorkerJob{.leases = job.leases};
    }
  });
  absent_.erase(identity_of(hello));
  return other_process;
}

void WorkerRegistry::end_current(SessionId session) {
  if (Worker* const worker = of(session)) {
    change(*worker, [&] { worker->session_.reset(); });
    idle_.erase(worker->name());
  }
  sessions_.at(session).current = false;
}

Worker* WorkerRegistry::close_session(SessionId session) {
  Worker* const worker = of(session);
  if (worker != nullptr) {
    if (!worker->draining_) {
      absent_[identity_of(worker->hello_)] = {worker->last_message_, worker->hello_.fingerprint_class,
                                              worker->hello_.renderer_version};
    }
    end_current(session);
  }
  sessions_.erase(session);
  return worker;
}

void WorkerRegistry::drain(Worker& worker) {
  change(worker, [&] { worker.draining_ = true; });
  idle_.erase(worker.name());
}

void WorkerRegistry::quarantine(Worker& worker, bool quarantined) {
  change(worker, [&] { worker.quarantined_ = quarantined; });
  if (quarantined) {
    idle_.erase(worker.name());
  }
}

void WorkerRegistry::forget_if_gone(const std::string& name, const Event& event) {
  const auto found = workers_.find(name);
  if (found != workers_.end() && !found->second.session_ && found->second.leases_.empty()) {
    idle_.erase(name);
    event.effects.departed.push_back(found->second.count());
    workers_.erase(found);
  }
}

void WorkerRegistry::forget_job(JobId job) {
  for (auto& [name, worker] : workers_) {
    worker.jobs_.erase(job);
    worker.too_large_.erase(job);
  }
}

// ---- silence ----

bool WorkerRegistry::note_message(Worker& worker, bool result, Time now) {
  worker.last_message_ = now;
  if (result) {
    worker.result_at_ = now;
  }
  const bool was_silent = std::exchange(worker.silent_, false);
  if (was_silent) {
    idle_.insert(worker.name());
  }
  return was_silent;
}

void WorkerRegistry::fell_silent(const std::string& name) {
  if (Worker* const worker = find(name)) {
    worker->silent_ = true;
    idle_.erase(name);
  }
}

std::vector<SessionId> WorkerRegistry::too_silent(Time now) {
  next_silence_check_ = now + limits_.silence;
  std::vector<SessionId> silent;
  for (const auto& [name, worker] : workers_) {
    if (!worker.session_) {
      continue;
    }
    const Time end = std::max(worker.last_message_, backlog_at_) + limits_.silence;
    if (end > now) {
      next_silence_check_ = std::min(next_silence_check_, end);
    } else {
      silent.push_back(*worker.session_);
    }
  }
  next_silence_check_ = std::max(next_silence_check_, now + limits_.silence / kSilenceChecks);
  return silent;
}

std::optional<Time> WorkerRegistry::next_silence_check() const {
  return sessions_.empty() ? std::nullopt : std::optional(next_silence_check_);
}

void WorkerRegistry::note_stall(Duration late, Time now) {
  for (auto& [name, worker] : workers_) {
    worker.last_message_ = now;
  }
  for (auto& [identity, was] : absent_) {
    was.since += late;
  }
  next_silence_check_ = now + limits_.silence;
}

void WorkerRegistry::set_idle(const Worker& worker, bool idle) {
  if (idle) {
    idle_.insert(worker.name());
  } else {
    idle_.erase(worker.name());
  }
}

void WorkerRegistry::forget_absent(Time now) {
  std::erase_if(absent_, [&](const auto& entry) { return now >= entry.second.since + limits_.auditor_timeout; });
}

}  // namespace lightmill
