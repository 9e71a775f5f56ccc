// Parts of the coordinator, their wiring, and its time. Private to server/domain.
#pragma once

#include "server/domain/coordinator.h"
#include "server/domain/copies.h"
#include "server/domain/farm_view.h"
#include "server/domain/overruns.h"
#include "server/domain/preparations.h"
#include "server/domain/result_intake.h"
#include "server/domain/sessions.h"

namespace lightmill {

/// Each part knows only parts above it.
struct Coordinator::Parts {
  Parts(const CoordinatorLimits& the_limits, StoredState& stored, Time now)
      : limits(the_limits),
        epoch(stored.epoch),
        clock_time(now),
        signer(stored.secret),
        jobs(limits, stored.next_job_id),
        quarantined(std::move(stored.quarantine)),
        audits(limits, stored.secret, now, workers, quarantined, leases, provenance, totals) {}

  /// Event of a call that brings both times. Detects that the coordinator was stopped.
  Event at(Time now, std::int64_t unix_ms, Effects& effects);
  Event at(Time now, Effects& effects) const { return {now, unix_ms(now), effects}; }
  std::int64_t unix_ms(Time now) const;
  std::optional<Time> next_deadline() const;
  Status serve_if(const Result<bool>& changed, const Event& event);
  void heartbeat(Worker& worker, const WorkerHeartbeat& heartbeat, const Event& event);
  void pilot_reported(SessionId session, Worker& worker, const PilotReport& report, const Event& event);
  void take_film(Job& job, StoredFilm film, const Event& event);

  const CoordinatorLimits limits;
  const std::uint64_t epoch;
  Time clock_time;  ///< of the last call that brought both times
  std::int64_t clock_unix_ms = 0;
  FarmTotals totals;

  const GrantSigner signer;
  JobTable jobs;
  Films films{limits, jobs};
  WorkerRegistry workers{limits};
  QuarantineList quarantined;
  Provenance provenance;
  JobQueue queue{limits, workers};
  LeaseTable leases{limits, epoch, signer, workers, jobs, queue, totals};
  Inspections inspections{workers, epoch << 32 | 1};  // ids that no other coordinator uses

  Audits audits;
  JobLifeCycle life_cycle{limits, jobs, films, leases, workers, queue, audits, provenance, totals};
  Pilots pilots{leases, jobs, queue, life_cycle};
  Scheduler scheduler{limits, clock_time, jobs, leases, workers, queue, life_cycle, pilots};
  Preparations preparations{jobs, leases, workers, queue, scheduler};
  Copies copies{limits, jobs, leases, workers, pilots, scheduler};
  Quarantine quarantine{quarantined, jobs, leases, workers, queue, provenance, life_cycle, scheduler, totals};
  Overruns overruns{limits, jobs, leases, queue, life_cycle, scheduler};
  Dismissals dismissals{limits, leases, workers, life_cycle, scheduler, inspections};
  Sessions sessions{limits, signer,     jobs,      leases,      workers,   quarantined,
                    queue,  life_cycle, scheduler, inspections, dismissals};
  ResultIntake intake{signer,     jobs,      leases, workers,    quarantined, queue, provenance,
                      life_cycle, scheduler, audits, quarantine, dismissals,  totals};
  WaitReasons waits{jobs, leases, audits, scheduler};
  FarmView view{limits, jobs, leases, workers, quarantined, audits, scheduler, waits, totals};
};

}  // namespace lightmill
