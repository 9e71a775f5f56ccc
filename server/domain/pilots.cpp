// How the method of a job is chosen, and what part of its samples each tile gets: by a pilot, which is a lease without
// tiles.
#include "common/base/text.h"
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// As of one result: see results.cpp.
constexpr double kMaxPilotSeconds = 1e7;
constexpr std::size_t kMaxPilotReasonBytes = 1024;
/// A worker that has lost two pilots gets its next one so much later; each further loss doubles it, up to the most.
constexpr Duration kLeastHold = std::chrono::milliseconds(500);
constexpr Duration kMostHold = std::chrono::seconds(32);

Status check_pilot(const Job& job, const PilotReport& report) {
  const std::vector<std::string>& methods = job.record.method_notes.candidates;
  if (report.choice >= methods.size()) {
    return invalid_argument("a pilot of {} methods has chosen number {}", methods.size(), report.choice);
  }
  if (!(report.seconds >= 0 && report.seconds <= kMaxPilotSeconds)) {
    return invalid_argument("a pilot of {} seconds", report.seconds);
  }
  if (report.reasons.size() > methods.size() + 1) {
    return invalid_argument("a pilot of {} methods has {} reasons", methods.size(), report.reasons.size());
  }
  const std::size_t shifts = report.allocation.shifts().size(),
                    tiles = job.record.spec.goal.adaptive ? job.film.grid().tile_count() : 0;
  if (shifts != 0 && shifts != tiles) {
    return invalid_argument("a pilot says what {} tiles get, of {}", shifts, tiles);
  }
  for (const std::string& reason : report.reasons) {
    if (reason.size() > kMaxPilotReasonBytes) {
      return invalid_argument("a pilot's reason has {} bytes, more than {}", reason.size(), kMaxPilotReasonBytes);
    }
  }
  return ok_status();
}

}  // namespace

bool Coordinator::State::may_pilot(const Worker& worker, const Job& job, Time now) const {
  return now >= worker.pilots_from && may_render(worker, job);
}

void Coordinator::State::hold_pilots_back(Worker& worker, Time now) const {
  if (++worker.pilots_lost > 1) {
    // Its next heartbeat after that asks again.
    worker.pilots_from = now + std::min(kLeastHold * (1 << std::min(worker.pilots_lost - 2, 16u)), kMostHold);
  }
}

/// Whoever gets the pilot also fixes the job's class. Whatever is lost on the way, it is granted again and comes to the
/// same, because it is a function of the job alone.
void Coordinator::State::grant_pilot(Worker& worker, Job& job, Time now, Step& step) {
  if (job.record.fingerprint_class.empty()) {
    start_job(job, worker, step);
  }
  const std::vector<std::string>& methods = job.record.method_notes.candidates;
  const LeaseId id = next_lease_id();
  Lease& lease = open_lease(worker, job, id, Unit{job.id(), {}, {}}, false, now);
  lease.alone = is_suspect(job.suspicion_of_pilot);
  wait_until_sent(worker, job, lease);
  send_after_commit(step, *worker.session,
                    PilotGrant{id, job.id(), job.record.spec.settings, methods, job.record.spec.goal.adaptive});
  note(step, Note::Level::info, about(job.id(), worker.hello.name), "worker {} {} {} for job {}", worker.hello.name,
       methods.size() > 1 ? "compares" : "looks for the noise of", fmt::join(methods, " and "), job.id().value);
  refresh_queue(job);
}

void Coordinator::State::on_pilot(Worker& worker, const PilotReport& report, Time now, Step& step) {
  const auto found = leases.find(report.lease);
  if (found == leases.end() || found->second.worker != worker.hello.name || !found->second.unit.tiles.empty()) {
    return;  // taken for lost meanwhile
  }
  Job& job = *jobs.at(found->second.unit.job);
  MethodNotes& notes = job.record.method_notes;
  if (const Status status = check_pilot(job, report); !status.ok()) {
    note(step, Note::Level::warning, about(job.id(), worker.hello.name),
         "worker {}: the pilot of job {} is dropped: {}", worker.hello.name, job.id().value, message_of(status));
    distrust(*worker.session, report.lease, status, now, step);
    return;
  }
  worker.pilots_lost = 0;
  job.suspicion_of_pilot = {};
  end_lease(report.lease, false, false, now, step);
  while (!job.leases.empty()) {  // its copy, or what it was a copy of
    const LeaseId other = *job.leases.begin();
    end_lease(other, true, leases.at(other).abandoned, now, step);
  }
  job.record.spec.settings.method = notes.candidates[report.choice];
  for (const std::string& reason : report.reasons) {
    notes.reasons.push_back(printable(reason));
  }
  notes.candidates.clear();
  if (!report.allocation.even()) {
    job.record.allocation = report.allocation;
    job.film = Film(job.film.grid(), job.film.layout(), report.allocation);
    job.plan->set_goal(job.samples_wanted_now());
  }
  job.record.worker_seconds += report.seconds;
  job.digest = render_digest(job.record.spec.settings, job.record.fingerprint_class);
  job.digest_durable = false;  // leases wait until the method is stored
  put_job(job, step);
  note(step, Note::Level::info, about(job.id()), "job {} is rendered by {}: {}", job.id().value,
       job.record.spec.settings.method, fmt::join(notes.reasons, "; "));
  refresh_queue(job);
  serve(worker, now, step);
  serve_all(now, step);
}

}  // namespace lightmill
