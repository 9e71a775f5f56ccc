// Leases, jobs, tiles and results of the worker's session.
#include "worker/session/session.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/overloaded.h"

namespace lightmill {
Session::Session(SessionConfig config)
    : config_(std::move(config)), backoff_(config_.reconnect_least), refused_backoff_(config_.refused_least) {
  LM_CHECK(config_.threads > 0);
}

void Session::send(WorkerMessage message, SessionActions& actions) {
  actions.push_back(SendMessage{std::make_shared<const WorkerMessage>(std::move(message))});
}

// ---- messages of the coordinator ----

void Session::message(const CoordinatorMessage& message, Time now, SessionActions& actions) {
  if (exited_ || link_ != Link::up) {
    return;
  }
  std::visit(
      Overloaded{
          [&](const Welcome& welcome) { this->welcome(welcome, now, actions); },
          [&](const JobDescription& description) { describe_job(description, actions); },
          [&](const LeaseGrant& grant) { grant_lease(grant, actions); },
          [&](const ResultAck& ack) { acknowledge(ack, now, actions); },
          [&](const LeaseCancel& cancel) { cancel_leases(cancel, actions); },
          [&](const DrainRequest&) {
            actions.push_back(LogNotice{
                "the coordinator drains this worker: this worker finishes running tiles, gives back the rest and leaves"});
            begin_drain(false, now, actions);
          },
          [&](const PilotGrant& grant) { grant_pilot(grant, actions); },
          [&](const InspectGrant& grant) { grant_inspection(grant, actions); },
          [&](const Notice& notice) { actions.push_back(LogNotice{"the coordinator says: " + notice.text}); },
          [&](const Dismissal& dismissal) { exit(dismissal.reason, true, actions); },
      },
      message);
  advance(actions);
}

void Session::describe_job(const JobDescription& description, SessionActions& actions) {
  if (const auto found = jobs_.find(description.job); found != jobs_.end()) {
    if (found->second.description->render_digest == description.render_digest) {
      return;
    }
    // Another job has the same number, so another farm answers at this address now. Work for the old job is worthless.
    erase_leases_of(description.job, actions);
    forget_job(description.job, actions);
    std::erase_if(results_, [&](const auto& entry) {
      const bool of_old_job = entry.first.job == description.job;
      result_bytes_ -= of_old_job ? entry.second.bytes : 0;
      return of_old_job;
    });
    stop_tiles([&](const Rendering& rendering) { return rendering.key.job == description.job; }, actions);
  }
  Job& job = jobs_[description.job];
  job.description = std::make_shared<const JobDescription>(description);
  job.state = Job::State::preparing;
  actions.push_back(PrepareJob{job.description});
}

void Session::grant_lease(const LeaseGrant& grant, SessionActions& actions) {
  if (leases_.contains(grant.lease) || grant.unit.tiles.empty()) {
    return;
  }
  const auto job = jobs_.find(grant.unit.job);
  if (draining_ || job == jobs_.end() || leases_.size() >= config_.max_leases) {
    return send(WorkerReturn{grant.lease}, actions);
  }
  ++job->second.leases;
  Lease& lease = leases_[grant.lease];
  lease.epoch = epoch_;
  lease.unit = grant.unit;
  lease.trace = grant.trace;
  for (std::size_t i = 0; i < grant.unit.tiles.size() && i < grant.tags.size(); ++i) {
    lease.tags[grant.unit.tiles[i]] = grant.tags[i];
  }
  lease.description = job->second.description;
  for (const TileId tile : grant.unit.tiles) {
    // Results of an earlier lease that still wait for their acknowledgement are not rendered again.
    if (!results_.contains({grant.unit.job, tile, grant.unit.range})) {
      lease.queued.push_back(tile);
    }
  }
  erase_lease_if_finished(grant.lease, actions);
}

void Session::acknowledge(const ResultAck& ack, Time now, SessionActions& actions) {
  extend_drain(now);
  for (const NodeKey& key : ack.keys) {
    const auto found = results_.find(key);
    if (found == results_.end()) {
      continue;
    }
    result_bytes_ -= found->second.bytes;
    longest_wait_ = std::max(longest_wait_.value_or(Duration::zero()), now - found->second.sent);
    const LeaseId lease_id = std::get<WorkerResult>(*found->second.message).lease;
    actions.push_back(ResultStored{std::move(found->second.message)});
    results_.erase(found);
    if (const auto lease = leases_.find(lease_id); lease != leases_.end()) {
      lease->second.unacknowledged.erase(key.tile);
      erase_lease_if_finished(lease_id, actions);
    }
  }
}

void Session::cancel_leases(const LeaseCancel& cancel, SessionActions& actions) {
  for (const LeaseId id : cancel.leases) {
    if (pilots_.erase(id) > 0) {
      actions.push_back(DropPilot{id});
    }
    if (leases_.contains(id)) {
      stop_tiles([id](const Rendering& rendering) { return rendering.lease == id; }, actions);
      erase_lease(id, actions);
    }
  }
}

// ---- pilots ----

void Session::grant_pilot(const PilotGrant& grant, SessionActions& actions) {
  if (pilots_.contains(grant.lease)) {
    return;
  }
  if (draining_ || pilots_.size() >= config_.max_leases) {
    return send(WorkerReturn{grant.lease}, actions);
  }
  Pilot& pilot = pilots_[grant.lease];
  pilot.grant = std::make_shared<const PilotGrant>(grant);
  actions.push_back(RunPilot{pilot.grant});
}

void Session::drop_pilots(SessionActions& actions) {
  for (const auto& [id, pilot] : pilots_) {
    actions.push_back(DropPilot{id});
  }
  pilots_.clear();
}

void Session::pilot_done(PilotReport report, Time now, SessionActions& actions) {
  extend_drain(now);
  if (exited_ || pilots_.erase(report.lease) == 0) {
    return;  // cancelled, or its stream broke and the pilot is granted again
  }
  send(std::move(report), actions);
  advance(actions);
}

void Session::pilot_failed(LeaseId lease, const JobRefusal& refused, Time, SessionActions& actions) {
  if (const auto found = pilots_.find(lease); !exited_ && found != pilots_.end()) {
    send(WorkerRefusal{found->second.grant->job, refused.reason, refused.own_limits}, actions);
    pilots_.erase(found);
    advance(actions);
  }
}

void Session::pilot_at_work(LeaseId lease, double cpu_seconds) {
  if (const auto found = pilots_.find(lease); found != pilots_.end()) {
    found->second.cpu_seconds = cpu_seconds;
  }
}

void Session::pilot_unavailable(LeaseId lease, Time now, SessionActions&) {
  if (const auto found = pilots_.find(lease); found != pilots_.end()) {
    found->second.retry = now + config_.prepare_retry;
  }
}

// ---- inspections ----

void Session::grant_inspection(const InspectGrant& grant, SessionActions& actions) {
  if (draining_ || inspection_ == grant.inspection) {
    return;  // the coordinator learns of the drain and chooses another worker
  }
  inspection_ = grant.inspection;
  actions.push_back(RunInspection{std::make_shared<const InspectGrant>(grant)});
}

void Session::drop_inspection(SessionActions& actions) {
  if (inspection_) {
    inspection_.reset();
    actions.push_back(DropInspection{});
  }
}

void Session::inspection_done(InspectReport report, SessionActions& actions) {
  if (!exited_ && inspection_ == report.inspection) {
    inspection_.reset();
    send(std::move(report), actions);
  }
}

// ---- jobs ----

Session::Job* Session::preparing_job(JobId id) {
  const auto found = jobs_.find(id);
  const bool preparing = !exited_ && found != jobs_.end() && found->second.state == Job::State::preparing;
  return preparing ? &found->second : nullptr;
}

void Session::job_ready(JobId id, Time, SessionActions& actions) {
  if (Job* const job = preparing_job(id)) {
    job->state = Job::State::ready;
    forget_job_if_idle(id, actions);
    advance(actions);
  }
}

void Session::job_unavailable(JobId id, Time now, SessionActions& actions) {
  if (Job* const job = preparing_job(id)) {
    job->state = Job::State::unavailable;
    job->retry = now + config_.prepare_retry;
    forget_job_if_idle(id, actions);
    advance(actions);
  }
}

void Session::job_failed(JobId id, const JobRefusal& refused, Time, SessionActions& actions) {
  if (preparing_job(id) != nullptr) {
    refuse(id, refused, actions);
    advance(actions);
  }
}

void Session::refuse(JobId id, const JobRefusal& refused, SessionActions& actions) {
  if (link_ == Link::up) {
    send(WorkerRefusal{id, refused.reason, refused.own_limits}, actions);
  }
  // The leases are dropped. If the coordinator missed the refusal, it grants them again and gets another refusal.
  erase_leases_of(id, actions);
  forget_job(id, actions);
  stop_tiles([id](const Rendering& rendering) { return rendering.key.job == id; }, actions);
}

void Session::erase_leases_of(JobId job, SessionActions& actions) {
  std::vector<LeaseId> of_job;
  for (const auto& [id, lease] : leases_) {
    if (lease.unit.job == job) {
      of_job.push_back(id);
    }
  }
  for (const LeaseId id : of_job) {
    erase_lease(id, actions);
  }
}

void Session::forget_job(JobId id, SessionActions& actions) {
  if (jobs_.erase(id) > 0) {
    actions.push_back(ForgetJob{id});
  }
}

void Session::forget_job_if_idle(JobId id, SessionActions& actions) {
  // A job that was just described waits for its lease.
  const auto found = jobs_.find(id);
  if (found != jobs_.end() && found->second.leases == 0 && found->second.had_lease) {
    forget_job(id, actions);
  }
}

// ---- tiles ----

void Session::advance(SessionActions& actions) {
  if (exited_) {
    return;
  }
  std::vector<LeaseId> finished;
  for (const bool first_samples : {true, false}) {  // a picture waits for first samples
    for (auto& [id, lease] : leases_) {
      if ((lease.unit.range.first() == 0) == first_samples && hand_out(id, lease, actions)) {
        finished.push_back(id);
      }
    }
  }
  for (const LeaseId id : finished) {
    erase_lease_if_finished(id, actions);
  }
  if (!draining_) {
    return;
  }
  if (link_ == Link::up) {
    std::vector<LeaseId> given_back;
    for (const auto& [id, lease] : leases_) {
      if (lease.give_back && lease.rendering.empty()) {
        given_back.push_back(id);
      }
    }
    for (const LeaseId id : given_back) {
      send(WorkerReturn{id}, actions);
      erase_lease(id, actions);
    }
  }
  // A coordinator that is away cannot take anything back. It will notice that the worker is gone.
  if ((leases_.empty() || link_ != Link::up) && pilots_.empty() && rendering_.empty() && results_.empty()) {
    exit("drained", false, actions);
  }
}

bool Session::hand_out(LeaseId id, Lease& lease, SessionActions& actions) {
  const auto job = jobs_.find(lease.unit.job);
  if (job == jobs_.end() || job->second.state != Job::State::ready) {
    return false;
  }
  while (!lease.queued.empty() && rendering_.size() < std::size_t{2} * config_.threads &&
         result_bytes_ < config_.unacknowledged_bytes) {
    const TileId tile = lease.queued.front();
    lease.queued.pop_front();
    if (!results_.contains({lease.unit.job, tile, lease.unit.range})) {  // rendered for an earlier lease
      render(lease, id, tile, actions);
    }
  }
  return lease.queued.empty();
}

void Session::render(Lease& lease, LeaseId id, TileId tile, SessionActions& actions) {
  const NodeKey key{lease.unit.job, tile, lease.unit.range};
  const auto [at, fresh] = rendering_ticket_.emplace(key, next_ticket_);
  Rendering& rendering = rendering_[at->second];
  if (fresh) {
    rendering.key = key;
    actions.push_back(RenderTile{next_ticket_++, lease.description, key, id, lease.trace});
  } else if (const auto former = leases_.find(rendering.lease); former != leases_.end()) {
    former->second.rendering.erase(tile);  // it is being rendered; the result will belong to this lease
  }
  rendering.lease = id;
  lease.rendering.insert(tile);
}

void Session::stop_tiles(const std::function<bool(const Rendering&)>& unwanted, SessionActions& actions) {
  for (auto& [ticket, rendering] : rendering_) {
    if (rendering.wanted && unwanted(rendering)) {
      rendering.wanted = false;
      rendering_ticket_.erase(rendering.key);
      actions.push_back(StopTile{ticket});
    }
  }
}

void Session::tile_rendered(RenderedTile tile, Time now, SessionActions& actions) {
  const auto found = rendering_.find(tile.ticket);
  if (exited_ || found == rendering_.end()) {
    return;
  }
  const Rendering rendering = found->second;
  rendering_.erase(found);
  if (rendering.wanted) {
    rendering_ticket_.erase(rendering.key);
    if (tile.lacks.empty()) {
      take_result(rendering, std::move(tile), now, actions);
    } else {
      actions.push_back(LogNotice{fmt::format("{} cannot be rendered: {}", describe(rendering.key), tile.lacks)});
      refuse(rendering.key.job, {std::move(tile.lacks), true}, actions);
    }
  }
  extend_drain(now);
  advance(actions);
}

void Session::take_result(const Rendering& rendering, RenderedTile tile, Time now, SessionActions& actions) {
  ++tiles_rendered_;
  const Duration took = from_seconds(tile.seconds);
  longest_tile_ = took > longest_tile_ ? took : longest_tile_ + (took - longest_tile_) / 16;
  const auto at = leases_.find(rendering.lease);
  if (at == leases_.end()) {
    return;  // its lease is gone
  }
  const NodeKey key = rendering.key;
  Lease& lease = at->second;
  lease.rendering.erase(key.tile);
  lease.unacknowledged.insert(key.tile);
  Result result;
  result.bytes = tile.node.values.size() * sizeof(float);
  result.sequence = next_sequence_++;
  result.sent = now;
  result.message = std::make_shared<const WorkerMessage>(WorkerResult{rendering.lease, key, std::move(tile.node),
                                                                      tile.hash, lease.description->render_digest,
                                                                      tile.seconds, lease.trace, lease.tags[key.tile]});
  if (link_ == Link::up && welcomed_) {
    actions.push_back(SendMessage{result.message});
  }
  result_bytes_ += result.bytes;
  results_[key] = std::move(result);
}

void Session::at_work(std::uint64_t ticket, double cpu_seconds) {
  if (const auto found = rendering_.find(ticket); found != rendering_.end()) {
    found->second.cpu_seconds = cpu_seconds;
  }
}

void Session::erase_lease_if_finished(LeaseId id, SessionActions& actions) {
  const Lease& lease = leases_.at(id);
  if (lease.queued.empty() && lease.rendering.empty() && lease.unacknowledged.empty() && !lease.give_back) {
    erase_lease(id, actions);
  }
}

void Session::erase_lease(LeaseId id, SessionActions& actions) {
  const auto found = leases_.find(id);
  const JobId job_id = found->second.unit.job;
  leases_.erase(found);
  if (const auto job = jobs_.find(job_id); job != jobs_.end()) {
    --job->second.leases;
    job->second.had_lease = true;
    forget_job_if_idle(job_id, actions);
  }
}

}  // namespace lightmill
