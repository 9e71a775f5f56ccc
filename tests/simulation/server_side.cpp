// The coordinator in its simulated process: steps, commits, crashes, and what must hold of what it sends.
#include <algorithm>

#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {

StoredState FarmSimulation::load_checked() {
  check_acknowledged_is_durable();
  StoredState state = disk_.load();
  if (bugs_.forget_jobs && state.jobs.size() > 1 && chaos_now()) {
    state.jobs.pop_back();
  }
  if (bugs_.forget_quarantine) {
    state.quarantine.clear();
  }
  return state;
}

void FarmSimulation::start_server() {
  ++server_life_;
  trace("a coordinator starts");
  StoredState stored = load_checked();
  merged_by_.clear();
  for (const StoredState::StoredJob& job : stored.jobs) {
    for (const StoredState::StoredResult& result : job.results) {
      merged_by_[{job.record.id, result.tile, result.range}] = stored.renderers.at(result.by);
    }
  }
  coordinator_ = std::make_unique<Coordinator>(limits_, std::move(stored), now_);
  next_server_tick_ = Time::max();
  plan_server_tick();
  const std::vector<WorkerStatus> known = coordinator_->workers(now_);
  for (const auto& [worker, record] : disk_.quarantine()) {
    if (std::ranges::none_of(
            known, [&](const WorkerStatus& each) { return each.name == worker && each.quarantine == record.reason; })) {
      fail(fmt::format("a coordinator starts and does not know of {}'s quarantine", worker));
    }
  }
}

void FarmSimulation::crash_server(bool commit_lands) {
  if (!coordinator_) {
    return;
  }
  ++report_.restarts;
  trace("the coordinator is killed");
  ++server_life_;
  coordinator_.reset();
  // What was being written lands as a whole or not at all; nobody hears of it.
  std::vector<StoreOp> ops;
  for (Pending& each : committing_) {
    ops.insert(ops.end(), each.writes.begin(), each.writes.end());
  }
  committing_.clear();
  pending_.clear();
  if (bugs_.torn_commits) {
    ops.resize(ops.size() / 2);
    commit_lands = true;
  }
  if (commit_lands) {
    if (const auto wrong = disk_.apply(ops)) {
      fail(*wrong);
      return;
    }
    note_stored(ops);
  }
  for (const auto& [session, stream] : streams_) {
    break_stream(stream);
  }
  streams_.clear();
  after(random_.seconds_between(0.05, 3), [this] { start_server(); });
}

void FarmSimulation::on_server(const std::function<void(Step&)>& call) {
  if (!coordinator_) {
    return;
  }
  Step step;
  call(step);
  execute(std::move(step), {});
}

void FarmSimulation::execute(Step step, std::vector<Action> replies) {
  note_writes(step);
  check_decisions(step);
  note_unwanted(step);
  for (const Note& note : step.notes) {
    trace("{}", note.text);
  }
  for (Outgoing& message : step.now) {
    server_sends(std::move(message));
  }
  for (const SessionId session : step.hang_ups) {
    if (const auto found = streams_.find(session); found != streams_.end()) {
      break_stream(found->second);
    }
  }
  if (bugs_.acknowledge_before_commit || bugs_.lease_before_commit) {
    std::vector<Outgoing> rest;
    for (Outgoing& message : step.after_commit) {
      const bool is_ack = std::holds_alternative<ResultAck>(message.message);
      if (is_ack ? bugs_.acknowledge_before_commit : bugs_.lease_before_commit) {
        server_sends(std::move(message));
      } else {
        rest.push_back(std::move(message));
      }
    }
    step.after_commit = std::move(rest);
  }
  pending_.push_back({std::move(step.writes), std::move(step.after_commit), std::move(replies)});
  if (committing_.empty()) {
    start_commit();
  }
  plan_server_tick();
}

void FarmSimulation::start_commit() {
  if (pending_.empty()) {
    return;
  }
  // Group commit: all that waits shares a transaction, or only some of it, in order.
  const std::size_t count =
      chaos_.restarts && random_.chance(0.3) ? 1 + random_.below(pending_.size()) : pending_.size();
  bool writes = false;
  for (std::size_t i = 0; i < count; ++i) {
    writes = writes || !pending_.front().writes.empty();
    committing_.push_back(std::move(pending_.front()));
    pending_.pop_front();
  }
  const std::uint64_t life = server_life_;
  if (writes && crash_at_commit_.erase(++commits_) > 0) {
    crash_server(random_.chance(0.5));
    return;
  }
  const Duration latency = !writes                ? Duration{0}
                           : random_.chance(0.05) ? random_.seconds_between(0.1, 0.5)
                                                  : random_.seconds_between(0.002, 0.02);
  after(latency, [this, life] {
    if (life == server_life_) {
      finish_commit();
    }
  });
}

void FarmSimulation::finish_commit() {
  std::vector<Pending> done = std::exchange(committing_, {});
  std::vector<StoreOp> ops;
  for (Pending& each : done) {
    for (StoreOp& op : each.writes) {
      const bool lost = (bugs_.lose_a_write && std::holds_alternative<PutNode>(op) && random_.chance(0.05)) ||
                        (bugs_.keep_joined_nodes && std::holds_alternative<DropNode>(op)) ||
                        (bugs_.keep_dropped_results && std::holds_alternative<DropResults>(op));
      if (auto* result = std::get_if<PutResult>(&op); result != nullptr && bugs_.lose_verifications) {
        result->to_verify = false;
      }
      if (!lost) {
        ops.push_back(std::move(op));
      }
    }
  }
  if (const auto wrong = disk_.apply(ops)) {
    fail(*wrong);
    return;
  }
  note_stored(ops);
  if (chaos_.restarts && chaos_now() && random_.chance(0.002)) {
    crash_server(false);  // between the commit and what depends on it
    return;
  }
  for (Pending& each : done) {
    for (Outgoing& message : each.after_commit) {
      server_sends(std::move(message));
    }
    for (const Action& reply : each.replies) {
      reply();
    }
  }
  start_commit();
}

void FarmSimulation::plan_server_tick() {
  if (!coordinator_ || bugs_.never_requeue) {
    return;  // without ticks no lease ever expires
  }
  const std::optional<Time> next = coordinator_->next_deadline();
  if (!next || *next >= next_server_tick_) {
    return;
  }
  next_server_tick_ = std::max(*next, now_);
  const std::uint64_t life = server_life_;
  at(next_server_tick_, [this, life, time = next_server_tick_] {
    if (life == server_life_ && time == next_server_tick_) {
      next_server_tick_ = Time::max();
      on_server([&](Step& step) { coordinator_->tick(now_, unix_ms(), step); });
    }
  });
}

void FarmSimulation::server_sends(Outgoing message) {
  const auto found = streams_.find(message.to);
  if (found == streams_.end()) {
    return;
  }
  const std::shared_ptr<Stream> stream = found->second;
  if (const auto* grant = std::get_if<LeaseGrant>(&message.message)) {
    trace("lease {} to {}: job {}, samples [{}, {}) of {} tiles from {}", grant->lease.value,
          workers_[stream->worker].name, grant->unit.job.value, grant->unit.range.first(), grant->unit.range.end(),
          grant->unit.tiles.size(), grant->unit.tiles[0].value);
    check_grant(*stream, *grant);
  }
  if (const auto* ack = std::get_if<ResultAck>(&message.message)) {
    check_ack(*stream, *ack);
    if (bugs_.lose_acknowledgements) {
      return;
    }
  }
  if (stream->broken) {
    return;
  }
  const int times = chaos_.repeats && random_.chance(0.05) ? 2 : 1;
  for (int i = 0; i < times; ++i) {
    const Duration delay =
        random_.chance(0.02) ? random_.seconds_between(0.1, 1) : random_.seconds_between(0.0002, 0.005);
    stream->last_down = std::max(stream->last_down, now_ + delay);
    at(stream->last_down, [this, stream, content = message.message] {
      if (stream->broken) {
        return;
      }
      on_worker(stream->worker, stream->worker_life,
                [this, stream, content](Session& session, SessionActions& actions) {
                  if (workers_[stream->worker].stream != stream) {
                    return;
                  }
                  if (const auto* ack = std::get_if<ResultAck>(&content)) {
                    for (const NodeKey& key : ack->keys) {
                      workers_[stream->worker].unacknowledged.erase(key);
                    }
                  }
                  session.message(content, now_, actions);
                });
    });
  }
}

void FarmSimulation::check_grant(const Stream& stream, const LeaseGrant& grant) {
  const JobRecord* const stored = disk_.job(grant.unit.job);
  if (stored == nullptr || stored->fingerprint_class.empty()) {
    fail(fmt::format("lease {} leaves before the class of job {} is stored", grant.lease.value, grant.unit.job.value));
    return;
  }
  if (!stored->method_notes.candidates.empty()) {
    fail(fmt::format("lease {} leaves before the method of job {} is stored", grant.lease.value, grant.unit.job.value));
    return;
  }
  const SimulatedWorker& to = workers_[stream.worker];
  if (stored->fingerprint_class != to.fingerprint) {
    fail(fmt::format("lease {} goes to a worker of class {}", grant.lease.value, workers_[stream.worker].fingerprint));
  }
}

bool FarmSimulation::may_verify(SessionId session, const NodeKey& key) const {
  const auto stream = streams_.find(session);
  const auto by = merged_by_.find(key);
  if (by == merged_by_.end()) {
    return has_liars_;  // a copy differs from what was joined there
  }
  return stream != streams_.end() && workers_[stream->second->worker].machine != by->second.machine;
}

void FarmSimulation::note_writes(const Step& step) {
  for (const StoreOp& op : step.writes) {
    if (const auto* result = std::get_if<PutResult>(&op)) {
      merged_by_[result->key] = result->by;
    } else if (const auto* drop = std::get_if<DropResults>(&op)) {
      dropped_.push_back(drop->key);
    } else if (const auto* held = std::get_if<PutQuarantine>(&op)) {
      ++report_.convicted;
      if (held->record.of.machine != "machine-of-lies" && !bugs_.wrong_bits) {
        fail(fmt::format("{} is convicted, which has not lied: {}", held->record.of.worker, held->record.reason));
      }
    }
  }
}

void FarmSimulation::note_stored(std::span<const StoreOp> ops) {
  for (const StoreOp& op : ops) {
    if (const auto* drop = std::get_if<DropResults>(&op)) {
      std::erase_if(acknowledged_, [&](const NodeKey& key) {
        return key.job == drop->key.job && key.tile == drop->key.tile && drop->key.range.contains(key.range);
      });
    } else if (const auto* verified = std::get_if<PutVerified>(&op)) {
      if (const Film* film = coordinator_ ? coordinator_->film(verified->key.job) : nullptr) {
        report_.verified += verified->key.range.count() *
                            static_cast<std::uint64_t>(film->grid().tile_rect(verified->key.tile).pixel_count());
      }
    }
  }
}

void FarmSimulation::check_decisions(const Step& step) {
  bool granted = false;
  for (const std::vector<Outgoing>* channel : {&step.now, &step.after_commit}) {
    for (const Outgoing& message : *channel) {
      const auto* grant = std::get_if<LeaseGrant>(&message.message);
      const Film* film = grant != nullptr ? coordinator_->film(grant->unit.job) : nullptr;
      if (film == nullptr) {
        continue;
      }
      granted = true;
      for (const TileId tile : grant->unit.tiles) {
        if (film->covered(tile, grant->unit.range) &&
            !may_verify(message.to, {grant->unit.job, tile, grant->unit.range})) {
          fail(fmt::format("lease {} names samples [{}, {}) of tile {}, which are merged", grant->lease.value,
                           grant->unit.range.first(), grant->unit.range.end(), tile.value));
        }
      }
    }
  }
  if (granted) {
    for (const WorkerStatus& worker : coordinator_->workers(now_)) {
      if (!worker.quarantine.empty() && worker.leases > 0) {
        fail(fmt::format("{} is in quarantine with {} leases", worker.name, worker.leases));
      }
      if (worker.leases > 8 * limits_.leases_per_worker + brought_[worker.name]) {
        fail(fmt::format("{} has {} leases", worker.name, worker.leases));
      }
    }
  }
}

/// A count may be raised, durably, between the decision that a result lies beyond it and the acknowledgement.
void FarmSimulation::note_unwanted(const Step& step) {
  for (const Outgoing& message : step.after_commit) {
    if (const auto* ack = std::get_if<ResultAck>(&message.message)) {
      const auto stream = streams_.find(message.to);
      const auto all = coordinator_->workers(now_);
      const bool disbelieved =
          stream != streams_.end() && std::ranges::any_of(all, [&](const WorkerStatus& worker) {
            return worker.name == workers_[stream->second->worker].name && !worker.quarantine.empty();
          });
      for (const NodeKey& key : ack->keys) {
        if (disbelieved || (stream != streams_.end() && workers_[stream->second->worker].lies == Lies::garbage)) {
          unwanted_.insert({message.to, key});
          continue;
        }
        const auto status = coordinator_->status(key.job, now_);
        if (status.ok() && status->goal.samples > 0 &&
            key.range.end() > coordinator_->film(key.job)->allocation().of_tile(key.tile, status->goal.samples)) {
          unwanted_.insert({message.to, key});
        }
      }
    }
  }
}

void FarmSimulation::check_ack(const Stream& stream, const ResultAck& ack) {
  for (const NodeKey& key : ack.keys) {
    if (const auto unwanted = unwanted_.find({stream.session, key}); unwanted != unwanted_.end()) {
      unwanted_.erase(unwanted);
      continue;
    }
    const JobRecord* const stored = disk_.job(key.job);
    if (stored == nullptr || stored->state == JobState::cancelled || stored->state == JobState::failed ||
        stored->fingerprint_class.empty() ||
        (stored->spec.goal.samples > 0 &&
         key.range.end() > stored->allocation.of_tile(key.tile, stored->spec.goal.samples))) {
      continue;  // not wanted
    }
    const auto digest = last_result_.find({stream.session, key});
    if (digest == last_result_.end()) {
      fail("an acknowledgement of what was never sent");
      return;
    }
    const bool of_this_job = digest->second == render_digest(stored->spec.settings, stored->fingerprint_class);
    const bool ended_by_time = stored->state == JobState::done && stored->spec.goal.seconds > 0;
    if (of_this_job && !ended_by_time && disk_.covers(key)) {
      acknowledged_.insert(key);
    }
    // Where a goal in error decides how many samples are wanted, they are fewer again once some are taken out.
    const bool dropped = std::ranges::any_of(dropped_, [&](const NodeKey& each) {
      return each.job == key.job &&
             (stored->spec.goal.error > 0 || (each.tile == key.tile && each.range.contains(key.range)));
    });
    if (of_this_job && !ended_by_time && !dropped && !disk_.covers(key)) {
      fail(fmt::format("job {}, tile {}, samples [{}, {}) are acknowledged but not durable", key.job.value,
                       key.tile.value, key.range.first(), key.range.end()));
    }
  }
}

void FarmSimulation::check_acknowledged_is_durable() {
  for (const NodeKey& key : acknowledged_) {
    if (disk_.job(key.job) != nullptr && !disk_.covers(key)) {
      fail(fmt::format("job {}, tile {}, samples [{}, {}) were acknowledged and are not on disk any more",
                       key.job.value, key.tile.value, key.range.first(), key.range.end()));
      return;
    }
  }
}

void FarmSimulation::server_receives(const std::shared_ptr<Stream>& stream, WorkerMessage message) {
  if (stream->broken || stream->server_life != server_life_ || !coordinator_) {
    return;
  }
  if (auto* result = std::get_if<WorkerResult>(&message)) {
    last_result_[{stream->session, result->key}] = result->render_digest;
    const Film* const film = coordinator_->film(result->key.job);
    if (bugs_.repeat_results) {
      result->node = first_results_.try_emplace(result->key, result->node).first->second;
      result->hash = hash_of(result->node);
    }
    if (bugs_.merge_twice && film != nullptr && result->key.range.end() < 8 &&
        film->covered(result->key.tile, result->key.range)) {
      // The same samples under the number of others: a film that adds whatever comes.
      result->key.range.index += 1;
      result->node.range = result->key.range;
      result->hash = hash_of(result->node);
      last_result_[{stream->session, result->key}] = result->render_digest;
    }
  }
  if (!stream->said_hello) {
    if (auto* hello = std::get_if<WorkerHello>(&message)) {
      stream->said_hello = true;
      brought_[hello->name] = hello->held.size();
      if (bugs_.ignore_machines) {
        hello->machine = hello->name;
      }
      on_server([&](Step& step) { coordinator_->worker_connected(stream->session, *hello, now_, step); });
    } else {
      fail("a stream does not begin with a hello");
    }
    return;
  }
  on_server(
      [&](Step& step) { coordinator_->worker_message(stream->session, std::move(message), now_, unix_ms(), step); });
}

}  // namespace lightmill::simulation
