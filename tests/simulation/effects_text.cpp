#include "tests/simulation/effects_text.h"

#include <fmt/ranges.h>

#include "common/base/overloaded.h"

namespace lightmill::simulation {
namespace {

std::string text_of(const SampleRange& range) {
  return fmt::format("[{}, {})", range.first(), range.end());
}

std::string text_of(const NodeKey& key) {
  return fmt::format("job {} tile {} {}", key.job.value, key.tile.value, text_of(key.range));
}

std::string text_of(const Renderer& by) {
  return fmt::format("'{}' on '{}' of '{}'", by.worker, by.identity, by.fingerprint_class);
}

std::string text_of(const JobCounters& counters) {
  return fmt::format("{} merged, {} duplicate, {} lost, {} copies, {} non-finite, {} audited, {} dropped",
                     counters.results_merged, counters.results_duplicate, counters.leases_lost, counters.copies_leased,
                     counters.non_finite, counters.results_audited, counters.nodes_dropped);
}

std::string text_of(const std::vector<ErrorPoint>& history) {
  std::string text;
  for (const ErrorPoint& point : history) {
    text += fmt::format(" ({} {} {} {})", point.samples, point.worker_seconds, point.rel_mse, point.half_width);
  }
  return text;
}

std::string text_of(const JobRecord& job) {
  const JobSpec& spec = job.spec;
  const MethodNotes& notes = job.method_notes;
  return fmt::format(
      "put job {} of {}: {} '{}' {} class '{}' priority {}, goal {} {} {} {}; {} {}, {} '{}' '{}' '{}', shifts {}; {} "
      "s, "
      "{} s of workers, {};{}; from {} to {}",
      job.id.value, spec.request_id, static_cast<int>(job.state), job.reason, static_cast<int>(job.reached),
      job.fingerprint_class, spec.priority, spec.goal.samples, spec.goal.seconds, spec.goal.error, spec.goal.adaptive,
      spec.settings.method, render_digest(spec.settings, "").hex(), notes.chosen, fmt::join(notes.reasons, "; "),
      fmt::join(notes.notices, "; "), fmt::join(notes.candidates, ", "), fmt::join(job.allocation.shifts(), " "),
      job.active_seconds, job.worker_seconds, text_of(job.counters), text_of(job.history), job.submitted_unix_ms,
      job.finished_unix_ms);
}

template <class Ids>
std::string values_of(const Ids& ids) {
  std::string text;
  for (const auto& id : ids) {
    text += fmt::format(" {}", id.value);
  }
  return text;
}

std::string text_of(const StoreOp& op) {
  return std::visit(Overloaded{
                        [](const PutJob& put) { return text_of(put.record); },
                        [](const PutProgress& put) {
                          return fmt::format("put progress of job {}: {} s, {} s of workers, {}", put.job.value,
                                             put.active_seconds, put.worker_seconds, text_of(put.counters));
                        },
                        [](const DeleteJobRows& rows) { return fmt::format("delete job {}", rows.job.value); },
                        [](const PutNode& put) {
                          return fmt::format("put node {}: {}", text_of(NodeKey{put.job, put.tile, put.node->range}),
                                             hash_of(*put.node).hex());
                        },
                        [](const DropNode& drop) { return "drop node " + text_of(drop.key); },
                        [](const PutResult& put) {
                          return fmt::format("put result {}: {} by {}{}", text_of(put.key), put.hash.hex(),
                                             text_of(put.by), put.audit_pending ? ", to be audited" : "");
                        },
                        [](const PutAudited& put) { return "audited: " + text_of(put.key); },
                        [](const DropResults& drop) { return "drop results " + text_of(drop.key); },
                        [](const PutQuarantine& put) {
                          return fmt::format("put quarantine {}: {}, at {}", text_of(put.record.of), put.record.reason,
                                             put.record.since_unix_ms);
                        },
                        [](const DropQuarantine& drop) { return "drop quarantine " + drop.worker; },
                        [](const auto&) { return std::string("a row that is no coordinator's"); },
                    },
                    op);
}

std::string text_of(const CoordinatorMessage& message) {
  return std::visit(
      Overloaded{
          [](const Welcome& welcome) {
            return fmt::format("welcome, epoch {}, {} s, {} s", welcome.epoch, to_seconds(welcome.heartbeat_interval),
                               to_seconds(welcome.lease_duration));
          },
          [](const JobDescription& job) {
            return fmt::format("job {}: {}, {}", job.job.value, job.render_digest.hex(),
                               render_digest(job.settings, "").hex());
          },
          [](const LeaseGrant& grant) {
            return fmt::format("lease {} of job {}, {}, tiles{}; {}", grant.lease.value, grant.unit.job.value,
                               text_of(grant.unit.range), values_of(grant.unit.tiles), grant.trace.hex());
          },
          [](const ResultAck& ack) {
            std::string text = "acknowledged:";
            for (const NodeKey& key : ack.keys) {
              text += " " + text_of(key);
            }
            return text;
          },
          [](const LeaseCancel& cancel) { return "cancelled:" + values_of(cancel.leases); },
          [](const DrainRequest&) { return std::string("drain"); },
          [](const Dismissal& dismissal) {
            return fmt::format("dismissed{}: {}", dismissal.for_now ? " for now" : "", dismissal.reason);
          },
          [](const PilotGrant& grant) {
            return fmt::format("pilot {} of job {}: {}, {}{}", grant.lease.value, grant.job.value,
                               render_digest(grant.settings, "").hex(), fmt::join(grant.methods, ", "),
                               grant.allocate ? ", with allocation" : "");
          },
          [](const Notice& notice) { return "notice: " + notice.text; },
          [](const InspectGrant& grant) { return fmt::format("inspection {}", grant.inspection.value); },
      },
      message);
}

std::string text_of(const Outgoing& outgoing) {
  return fmt::format("to {}: {}", outgoing.to.value, text_of(outgoing.message));
}

std::string text_of(const WorkerCount& worker) {
  return fmt::format("{}, {} threads, {} leases, {} results, {} lost, {} samples", worker.name, worker.threads,
                     worker.leases, worker.results, worker.leases_lost, worker.pixel_samples);
}

std::string text_of(const JobStatus& job) {
  return fmt::format(
      "job {} {} {} '{}' {} class '{}': {} of {}, {} to {}, {}; {} s, {} s of workers, {}/s, {} s left; error {} {} "
      "{};{}; {}, {} unaudited, ended {}, {}",
      job.id.value, static_cast<int>(job.state), job.spec.priority, job.reason, job.spec.settings.method,
      job.fingerprint_class, job.samples_done, job.samples_wanted, job.min_tile_samples, job.max_tile_samples,
      job.frame_samples, job.active_seconds, job.worker_seconds, job.samples_per_second, job.eta_seconds,
      job.error.known, job.error.rel_mse, job.error.half_width, text_of(job.history), text_of(job.counters),
      job.results_unaudited, job.finished_unix_ms, job.render_digest.hex());
}

std::string text_of(const WorkerStatus& worker) {
  return fmt::format("worker {} on {}: {} leases, {} {} '{}', {}/s for {} s, {} results, {} lost", worker.name,
                     worker.host, worker.leases, worker.connected ? "connected" : "gone",
                     worker.draining ? "draining" : "", worker.quarantine, worker.samples_per_second,
                     worker.connected_seconds, worker.results, worker.leases_lost);
}

}  // namespace

std::string effects_text(const Effects& effects) {
  std::string text;
  const auto add = [&text](const char* what, const auto& all) {
    for (const auto& each : all) {
      text += fmt::format("{}{}\n", what, text_of(each));
    }
  };
  add("store: ", effects.writes);
  add("now ", effects.now);
  add("after commit ", effects.after_commit);
  text += effects.closed.empty() ? "" : fmt::format("close{}\n", values_of(effects.closed));
  for (const InspectionOutcome& outcome : effects.inspected) {
    text += fmt::format("inspected {}: {}\n", outcome.id.value,
                        outcome.found.ok() ? "found" : message_of(outcome.found.status()));
  }
  for (const Note& note : effects.notes) {
    text += fmt::format("note {} {} '{}' {}: {}\n", note.level == Note::Level::info ? "info" : "warning",
                        note.job.value, note.worker, note.lease.value, note.text);
  }
  add("departed: ", effects.departed);
  text += effects.film_reads.empty() ? "" : fmt::format("read films{}\n", values_of(effects.film_reads));
  for (const FilmOutcome& outcome : effects.films) {
    text += fmt::format("film {}: {}\n", outcome.job.value, message_of(outcome.status));
  }
  return text;
}

std::string view_text(const Coordinator& coordinator, Time now) {
  std::string text;
  for (const JobStatus& job : coordinator.jobs(now)) {
    text += fmt::format("{}, version {}\n", text_of(job), coordinator.version(job.id));
  }
  for (const WorkerStatus& worker : coordinator.workers(now)) {
    text += text_of(worker) + "\n";
  }
  const FarmLoad load = coordinator.load();
  for (const WorkerCount& worker : load.workers) {
    text += text_of(worker) + "\n";
  }
  const FarmGauges gauges = coordinator.gauges(now);
  const FarmTotals& totals = coordinator.totals();
  text += fmt::format("{} samples, {} running, {} waiting; jobs {}, {} units, {} free, {} {} {} {} workers, {}, {}\n",
                      load.pixel_samples, load.jobs_running, load.jobs_waiting, fmt::join(gauges.jobs, " "),
                      gauges.leases, gauges.free_pixel_samples, gauges.rendering, gauges.idle, gauges.draining,
                      gauges.quarantined, gauges.threads, gauges.results_rate);
  text += fmt::format("{} {} {} {} {} {} {} {}\n", totals.leases_granted, totals.leases_lost, totals.results_merged,
                      totals.results_duplicate, totals.results_audited, totals.results_wrong, totals.pixel_samples,
                      totals.jobs_failed);
  const std::optional<Time> next = coordinator.next_deadline();
  return text + fmt::format("{} workers wanted, {}; next {}\n", coordinator.wanted_workers(now),
                            coordinator.wants_workers(), next ? next->time_since_epoch().count() : -1);
}

}  // namespace lightmill::simulation
