#include "server/domain/overruns.h"

#include <fmt/ranges.h>

namespace lightmill {

void Overruns::check(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event) {
  for (const TileAtWork& at_work : heartbeat.at_work) {
    const Lease* const lease = leases_.find(at_work.lease);
    if (lease == nullptr || lease->worker != worker.name() || !(lease->is_pilot() || lease->wants(at_work.tile))) {
      continue;
    }
    // A thread has no more CPU time than the lease is open.
    if (std::min(at_work.cpu_seconds, to_seconds(event.now - lease->granted)) <= limits_.tile_cpu_seconds) {
      continue;
    }
    if (lease->is_pilot()) {
      take_back_pilot(worker, Lease(*lease), event);
    } else {
      take_back(worker, Lease(*lease), at_work.tile, event);
    }
  }
}

void Overruns::take_back(Worker& worker, const Lease& lease, TileId tile, const Event& event) {
  Job& job = jobs_.at(lease.unit.job);
  const SampleRange range = lease.unit.range;
  const std::string reason =
      fmt::format("{} took more than {:g} s of CPU time", describe_place(job, tile, range), limits_.tile_cpu_seconds);
  event.warn(about(job.id(), worker.name(), lease.id), "worker {}: {}", worker.name(), reason);
  leases_.end(lease.id, {.cancel = true, .lost = lease.audits}, event);
  if (lease.audits) {
    return;
  }
  job.plan().cut_to_one_sample(tile, worker.identity());
  queue_.refresh(job);
  if (range.count() == 1) {
    job.refused(worker.identity(), worker.name(), reason, Refusals::Cause::overrun);
    life_cycle_.withdraw(job, worker, event);
  }
  scheduler_.serve_all(event);
}

void Overruns::take_back_pilot(Worker& worker, const Lease& lease, const Event& event) {
  Job& job = jobs_.at(lease.unit.job);
  const std::string reason =
      fmt::format("the pilot of job {} ({}) took more than {:g} s of CPU time", job.id().value,
                  fmt::join(job.record().method_notes.candidates, ", "), limits_.tile_cpu_seconds);
  event.warn(about(job.id(), worker.name(), lease.id), "worker {}: {}", worker.name(), reason);
  leases_.end(lease.id, {.cancel = true}, event);
  job.refused(worker.identity(), worker.name(), reason, Refusals::Cause::overrun);
  life_cycle_.withdraw(job, worker, event);
  scheduler_.serve_all(event);
}

}  // namespace lightmill
