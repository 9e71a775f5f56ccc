// Who gets nothing to render: workers that were found to be wrong, or put there by hand, and all others on their
// machines.
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

bool shares_guilt(const Renderer& guilty, const Renderer& other) {
  return other.worker == guilty.worker || (!guilty.machine.empty() && other.machine == guilty.machine);
}

}  // namespace

bool Coordinator::State::in_quarantine(const Renderer& renderer) const {
  return std::ranges::any_of(quarantine, [&](const auto& entry) { return shares_guilt(entry.second.of, renderer); });
}

std::string Coordinator::State::reason_for_quarantine(const Renderer& renderer) const {
  if (const auto own = quarantine.find(renderer.worker); own != quarantine.end()) {
    return own->second.reason;
  }
  for (const auto& [worker, record] : quarantine) {
    if (shares_guilt(record.of, renderer)) {
      return fmt::format("it is on the machine of {}: {}", record.of.worker, record.reason);
    }
  }
  return "";
}

void Coordinator::State::put_in_quarantine(const Renderer& guilty, const std::string& reason, Time now, Step& step) {
  const auto known = quarantine.find(guilty.worker);
  const bool proven = !reason.starts_with(Coordinator::kByHand);
  // What somebody has put there and what is then found to be wrong is there because it is wrong.
  if (known == quarantine.end() || known->second.of.machine != guilty.machine ||
      (proven && known->second.reason.starts_with(Coordinator::kByHand))) {
    const QuarantineRecord record{{guilty.worker, guilty.machine}, reason, unix_ms(now)};
    quarantine[guilty.worker] = record;
    step.writes.push_back(PutQuarantine{record});
    note(step, Note::Level::warning, about(guilty.worker), "worker {} is in quarantine, with all on its machine: {}",
         guilty.worker, reason);
  }
  std::vector<std::string> held_back;
  for (auto& [name, worker] : workers) {
    if (shares_guilt(guilty, renderer_of(worker.hello))) {
      hold_in_quarantine(worker, reason, now, step);
      held_back.push_back(name);
    }
  }
  for (const std::string& name : held_back) {
    forget_if_gone(name, step);  // it was known for its leases alone
  }
  let_go(now, step);  // of a worker that is on another machine now
}

void Coordinator::State::hold_in_quarantine(Worker& worker, const std::string& reason, Time now, Step& step) {
  if (worker.quarantined) {
    return;
  }
  if (counts(worker)) {
    farm_threads -= worker.hello.threads;
  }
  worker.quarantined = true;
  idle.erase(worker.hello.name);
  while (!worker.leases.empty()) {
    const LeaseId id = *worker.leases.begin();
    Job& job = *jobs.at(leases.at(id).unit.job);
    end_lease(id, true, false, now, step);
    put_progress(job, now, step);
    ending.insert(job.id());  // of one whose time is up it may have been the last
  }
  if (worker.session) {
    send_after_commit(step, *worker.session,
                      Notice{fmt::format("in quarantine, this worker gets nothing to render: {}", reason)});
  }
}

void Coordinator::State::undo_work_of(const Renderer& guilty, Time now, Step& step) {
  std::vector<bool> shares(renderers.size());
  for (std::size_t i = 0; i < renderers.size(); ++i) {
    shares[i] = shares_guilt(guilty, renderers[i]);
  }
  for (auto& [id, job] : jobs) {
    const JobState state = job->record.state;
    if (state == JobState::failed || state == JobState::cancelled) {
      continue;  // nobody renders it again
    }
    job->verifications.retract([&](const Renderer& by) { return shares_guilt(guilty, by); });
    refresh_queue(*job);
    std::vector<std::pair<TileId, SampleRange>> tainted;
    for (const auto& [place, parts] : job->parts) {
      if (std::ranges::any_of(parts, [&](std::uint32_t part) { return shares[part]; })) {
        tainted.push_back(place);
      }
    }
    if (tainted.empty()) {
      continue;
    }
    for (const auto& [tile, range] : tainted) {
      drop_node_with(*job, tile, range, now, step);
    }
    note(step, Note::Level::warning, about(id, guilty.worker),
         "job {}: {} nodes of its film, with results of {}, are rendered again", id.value, tainted.size(),
         describe_renderer(guilty));
    if (state == JobState::done) {
      reopen_done(*job, now);
    }
    put_job(*job, step);
    refresh_queue(*job);
    ending.insert(id);  // what is left may be all that is wanted
  }
}

void Coordinator::State::drop_node_with(Job& job, TileId tile, SampleRange within, Time now, Step& step) {
  const std::vector<NodePtr>& forest = job.film.forest(tile);
  const auto node = std::ranges::find_if(forest, [&](const NodePtr& each) { return each->range.contains(within); });
  if (node == forest.end()) {
    return;
  }
  const SampleRange range = (*node)->range;
  job.record.counters.non_finite -= (*node)->non_finite;
  ++job.record.counters.nodes_dropped;
  const auto before = static_cast<double>(job.film.pixel_samples());
  job.film.drop(tile, range);
  give_back_seconds(job, static_cast<double>(job.film.pixel_samples()) / before, now);
  job.parts.erase({tile, range});
  step.writes.push_back(DropNode{{job.id(), tile, range}});
  step.writes.push_back(DropResults{{job.id(), tile, range}});
  for (const auto& [place, lease] : job.verifications.close_within(tile, range)) {
    if (lease) {
      tile_done(*lease, tile, now, step, false);
    }
  }
  if (job.plan) {
    job.plan->reopen(tile);
  }
  ++job.version;
}

void Coordinator::State::give_back_seconds(Job& job, double kept, Time now) {
  if (job.record.spec.goal.seconds == 0) {
    return;
  }
  job.record.active_seconds = kept * job.active_seconds(now);
  if (job.active_since) {
    job.active_since = now;
  }
  if (job.plan && job.plan->closed() && !job.time_is_up(now)) {
    job.plan->set_goal(job.samples_wanted_now());
  }
}

Status Coordinator::quarantine_worker(const std::string& name, const std::string& reason, bool render_again, Time now,
                                      Step& step) {
  Renderer of{name, ""};
  if (const Worker* const worker = state_->find_worker(name)) {
    of = {name, machine_of(worker->hello)};
  } else if (const auto known = state_->quarantine.find(name); known != state_->quarantine.end()) {
    of = known->second.of;
  } else {
    const auto rendered = std::ranges::find(state_->renderers, name, &Renderer::worker);
    if (name.empty() || rendered == state_->renderers.end()) {
      return not_found("there is no worker '{}', and there was none of which the farm has results", name);
    }
    of = {name, rendered->machine};
  }
  state_->put_in_quarantine(of, reason, now, step);
  if (render_again) {
    state_->undo_work_of(of, now, step);
  }
  state_->serve_all(now, step);
  return ok_status();
}

Status Coordinator::release_worker(const std::string& name, Time now, Step& step) {
  State& state = *state_;
  Renderer of{name, ""};
  if (const Worker* const worker = state.find_worker(name)) {
    of.machine = machine_of(worker->hello);
  } else if (const auto record = state.quarantine.find(name); record != state.quarantine.end()) {
    of.machine = record->second.of.machine;  // it is away, and others of its machine may be here
  }
  std::vector<std::string> ended;
  for (const auto& [worker, record] : state.quarantine) {
    if (shares_guilt(record.of, of)) {
      ended.push_back(worker);
    }
  }
  if (ended.empty()) {
    return not_found("there is no worker '{}' in quarantine", name);
  }
  for (const std::string& worker : ended) {
    state.quarantine.erase(worker);
    step.writes.push_back(DropQuarantine{worker});
    note(step, Note::Level::info, about(worker), "worker {} is released from quarantine", worker);
  }
  state.let_go(now, step);
  return ok_status();
}

void Coordinator::State::let_go(Time now, Step& step) {
  for (auto& [each, worker] : workers) {
    if (worker.quarantined && !in_quarantine(renderer_of(worker.hello))) {
      worker.quarantined = false;
      if (counts(worker)) {
        farm_threads += worker.hello.threads;
      }
      if (worker.session) {
        send_after_commit(step, *worker.session, Notice{"released from quarantine"});
      }
      serve(worker, now, step);
    }
  }
}

}  // namespace lightmill
