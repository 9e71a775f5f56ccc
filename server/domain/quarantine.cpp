#include "server/domain/quarantine.h"

namespace lightmill {

void Quarantine::put(const Renderer& faulty, const std::string& reason, const Event& event) {
  const Worker* const here = workers_.find(faulty.worker);
  const QuarantineRecord record{{faulty.worker, faulty.identity},
                                reason,
                                event.unix_ms,
                                std::string(here == nullptr ? "" : here->host_as_identity())};
  if (list_.put(record)) {
    event.store(PutQuarantine{record});
    event.warn(about(faulty.worker), "worker {} is in quarantine, with all workers of {}: {}", faulty.worker,
               faulty.identity, reason);
  }
  std::vector<std::string> held;
  for (auto& [name, worker] : workers_.all()) {
    if (shares_quarantine(record, worker.renderer(), worker.host_as_identity())) {
      hold(worker, reason, event);
      held.push_back(name);
    }
  }
  for (const std::string& name : held) {
    workers_.forget_if_gone(name, event);  // it was known only for its leases
  }
  release_unlisted(event);  // workers of this name may have another identity now
}

void Quarantine::hold(Worker& worker, const std::string& reason, const Event& event) {
  if (worker.quarantined()) {
    return;
  }
  workers_.quarantine(worker, true);
  while (!worker.leases().empty()) {
    const LeaseId id = *worker.leases().begin();
    Job& job = jobs_.at(leases_.at(id).unit.job);
    leases_.end(id, {.cancel = true}, event);
    job.store_progress(event);
    life_cycle_.check_again(job.id());  // the lease may have been the last of a job whose time is up
  }
  if (worker.session()) {
    event.send_after_commit(*worker.session(),
                            Notice{fmt::format("this worker is in quarantine, and gets no work: {}", reason)});
  }
}

void Quarantine::release_unlisted(const Event& event) {
  for (auto& [name, worker] : workers_.all()) {
    if (worker.quarantined() && !list_.contains(worker.renderer(), worker.host_as_identity())) {
      workers_.quarantine(worker, false);
      if (worker.session()) {
        event.send_after_commit(*worker.session(), Notice{"released from quarantine"});
      }
      scheduler_.serve(worker, event);
    }
  }
}

void Quarantine::resolve(Job& job, const NodeKey& key, const Dispute& dispute, const Event& event) {
  if (dispute.agreed.empty() && !dispute.wrong.empty()) {
    pause_for_bug(job, key, dispute, event);
    return;
  }
  for (const Claim& claim : dispute.wrong) {
    if (claim.by.worker.empty()) {
      event.warn(about(job.id()), "{}: the joined node of several workers is wrong. It is dropped and rendered again",
                 describe_place(job, key.tile, key.range));
      drop_node(job, key.tile, key.range, event);
    } else {
      ++totals_.results_wrong;
      put(claim.by,
          fmt::format("its {} differ from those of {}, which agree", describe_place(job, key.tile, key.range),
                      describe_renderers(dispute.agreed)),
          event);
      undo_work_of(claim.by, event);
    }
  }
}

void Quarantine::pause_for_bug(Job& job, const NodeKey& key, const Dispute& dispute, const Event& event) {
  drop_node(job, key.tile, key.range, event);
  life_cycle_.pause(
      job,
      fmt::format("{} have {} different results, from {}: this is a bug of the program, not of a worker. Please report "
                  "it. Resume the job to render them again",
                  describe_place(job, key.tile, key.range), dispute.wrong.size(), describe_renderers(dispute.wrong)),
      event);
  event.warn(about(job.id()), "job {} is paused: {}", job.id().value, job.record().reason);
}

void Quarantine::undo_work_of(const Renderer& faulty, const Event& event) {
  const std::vector<bool> sharing = provenance_.sharing_quarantine(faulty);
  for (const auto& [id, job] : jobs_.all()) {
    const JobState state = job->state();
    if (state == JobState::failed || state == JobState::cancelled) {
      continue;  // it is not rendered again
    }
    job->audits().retract([&](const Renderer& by) { return shares_quarantine(faulty, by); });
    queue_.refresh(*job);
    const std::vector<Provenance::Place> places = provenance_.nodes_of(id, sharing);
    if (places.empty()) {
      continue;
    }
    for (const auto& [tile, range] : places) {
      drop_node(*job, tile, range, event);
    }
    event.warn(about(id, faulty.worker), "job {}: {} nodes of its film, with results of {}, are rendered again",
               id.value, places.size(), describe_renderer(faulty));
    if (state == JobState::done) {
      life_cycle_.reopen(*job, event.now);
    }
    job->store(event);
    queue_.refresh(*job);
    life_cycle_.check_again(id);  // the remaining samples may be all that is wanted
  }
}

void Quarantine::drop_node(Job& job, TileId tile, SampleRange within, const Event& event) {
  const std::optional<SampleRange> range = job.drop_node(tile, within, event.now);
  if (!range) {
    return;
  }
  provenance_.dropped(job.id(), tile, *range);
  event.store(DropNode{{job.id(), tile, *range}});
  event.store(DropResults{{job.id(), tile, *range}});
  for (const auto& [audit_key, lease] : job.audits().close_within(tile, *range)) {
    if (lease) {
      leases_.tile_done(*lease, tile, false, event);
    }
  }
}

// ---- requests ----

Status Quarantine::put(const std::string& name, const std::string& reason, bool render_again, const Event& event) {
  Renderer of{name, ""};
  if (const Worker* const worker = workers_.find(name)) {
    of = worker->renderer();
  } else if (const QuarantineRecord* const known = list_.find(name)) {
    of = known->of;
  } else if (const std::optional<Renderer> rendered = provenance_.find(name); rendered && !name.empty()) {
    of.identity = rendered->identity;
  } else if (!name.empty() &&
             std::ranges::any_of(workers_.all(), [&](const auto& each) { return each.second.identity() == name; })) {
    of.identity = name;
  } else {
    return not_found(
        "there is no worker '{}', none with a certificate or token of this name, and the farm has no results of one: "
        "`lightmill workers` lists names. A machine that has never connected cannot be put into quarantine",
        name);
  }
  put(of, reason, event);
  if (render_again) {
    undo_work_of(of, event);
  }
  scheduler_.serve_all(event);
  return ok_status();
}

Status Quarantine::release(const std::string& name, const Event& event) {
  Renderer of{name, ""};
  std::string host;
  if (const Worker* const worker = workers_.find(name)) {
    of = worker->renderer();
    host = worker->host_as_identity();
  } else if (const QuarantineRecord* const known = list_.find(name)) {
    host = known->host;
    of.identity = known->of.identity;  // it is gone, but others of its identity may be connected
  } else {
    of.identity = name;
  }
  const std::vector<std::string> released = list_.release(of, host);
  if (released.empty()) {
    return not_found("there is no worker '{}' in quarantine", name);
  }
  for (const std::string& worker : released) {
    event.store(DropQuarantine{worker});
    event.info(about(worker), "worker {} is released from quarantine", worker);
  }
  release_unlisted(event);
  return ok_status();
}

}  // namespace lightmill
