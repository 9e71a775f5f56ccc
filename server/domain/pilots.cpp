// How the method of a job is chosen: by a pilot, which is a lease without tiles.
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// As of one result: see results.cpp.
constexpr double kMaxPilotSeconds = 1e7;

}  // namespace

/// Whoever gets the pilot also fixes the job's class. Whatever is lost on the way, it is granted again and comes to the
/// same, because it is a function of the job alone.
void Coordinator::State::grant_pilot(Worker& worker, Job& job, Time now, Step& step) {
  if (job.record.fingerprint_class.empty()) {
    start_job(job, worker, step);
  }
  const LeaseId id = next_lease_id();
  open_lease(worker, job, id, Unit{job.id(), {}, {}}, false, now);
  send_after_commit(step, *worker.session,
                    PilotGrant{id, job.id(), job.record.spec.settings, job.record.method_notes.candidates});
  refresh_queue(job);
}

void Coordinator::State::on_pilot(Worker& worker, const PilotReport& report, Time now, Step& step) {
  const auto found = leases.find(report.lease);
  if (found == leases.end() || found->second.worker != worker.hello.name || !found->second.unit.tiles.empty()) {
    return;  // taken for lost meanwhile
  }
  Job& job = *jobs.at(found->second.unit.job);
  MethodNotes& notes = job.record.method_notes;
  const bool sound =
      report.choice < notes.candidates.size() && report.seconds >= 0 && report.seconds <= kMaxPilotSeconds;
  end_lease(report.lease, false, !sound, now, step);
  if (sound) {
    job.record.spec.settings.method = notes.candidates[report.choice];
    notes.reasons.insert(notes.reasons.end(), report.reasons.begin(), report.reasons.end());
    notes.candidates.clear();
    job.record.worker_seconds += report.seconds;
    job.digest = render_digest(job.record.spec.settings, job.record.fingerprint_class);
    job.class_durable = false;  // leases wait until the method is stored, too
    put_job(job, step);
    note(step, Note::Level::info, "job {} is rendered by {}: {}", job.id().value, job.record.spec.settings.method,
         fmt::join(notes.reasons, "; "));
  }
  refresh_queue(job);
  serve(worker, now, step);
  serve_all(now, step);
}

}  // namespace lightmill
