// The coordinator in its simulated process: steps, commits, and crashes.
#include <algorithm>

#include "server/store/check_rows.h"
#include "tests/simulation/effects_text.h"
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {

StoredState FarmSimulation::load_checked() {
  check_acknowledged_is_durable();
  StoredState state = disk_.load(bugs_.hide_damage);
  epoch_ = state.epoch;
  std::vector<StoreOp> repairs;
  if (const Status status = take_out_nonsense(state, repairs); !status.ok() || !repairs.empty()) {
    fail(fmt::format("a coordinator has stored what it cannot start from: {}",
                     status.ok() ? fmt::format("{} rows", repairs.size()) : message_of(status)));
  }
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
  for (const NodeKey& key : stored.damaged) {
    damaged_.insert({key.job, key.tile});
    std::erase_if(acknowledged_, [&](const NodeKey& each) {
      return each.job == key.job && each.tile == key.tile && key.range.contains(each.range);
    });
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
  if (now_ < disk_full_until_) {
    on_server([&](Effects& effects) { coordinator_->hold("the disk is full", now_, effects); });
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
  lose_inspections();
  abandon_commits(commit_lands);
  damage_disk();
  for (const auto& [session, stream] : streams_) {
    break_stream(stream);
  }
  streams_.clear();
  pending_.clear();
  after(random_.seconds_between(0.05, 3), [this] { start_server(); });
}

void FarmSimulation::abandon_commits(bool commit_lands) {
  commit_lands = commit_lands && now_ >= disk_full_until_;
  std::vector<StoreOp> ops;
  for (Pending& each : committing_) {
    ops.insert(ops.end(), each.writes.begin(), each.writes.end());
  }
  committing_.clear();
  if (bugs_.torn_commits) {
    ops.resize(ops.size() / 2);
    commit_lands = true;
  }
  if (commit_lands) {
    if (const auto wrong = disk_.apply(epoch_, ops)) {
      fail(*wrong);
      return;
    }
    note_stored(ops);
  }
}

void FarmSimulation::on_server(const std::function<void(Effects&)>& call) {
  if (!coordinator_) {
    return;
  }
  Effects effects;
  call(effects);
  execute(std::move(effects), {});
}

void FarmSimulation::note_effects(const Effects& effects, const Coordinator& coordinator) {
  if (effects_) {
    const std::string text = effects_text(effects) + view_text(coordinator, now_);
    effects_->append(as_byte_view(text));
    trace("{}", text);
  }
}

void FarmSimulation::execute(Effects effects, std::vector<Action> replies) {
  note_effects(effects, *coordinator_);
  note_inspected(effects);
  note_writes(effects);
  note_grants(effects);
  check_decisions(effects);
  note_unwanted(effects);
  for (const Note& note : effects.notes) {
    trace("{}", note.text);
  }
  for (Outgoing& message : effects.now) {
    server_sends(std::move(message));
  }
  check_losses(effects);
  for (const SessionId session : effects.closed) {
    if (const auto found = streams_.find(session); found != streams_.end()) {
      break_stream(found->second);
    }
  }
  if (bugs_.acknowledge_before_commit || bugs_.lease_before_commit || bugs_.blame_unsent) {
    std::vector<Outgoing> rest;
    if (bugs_.lease_before_commit || bugs_.blame_unsent) {
      coordinator_->grants_sent(leases_granted(effects.after_commit), now_);
    }
    for (Outgoing& message : effects.after_commit) {
      const bool is_ack = std::holds_alternative<ResultAck>(message.message);
      if (is_ack ? bugs_.acknowledge_before_commit : bugs_.lease_before_commit) {
        server_sends(std::move(message));
      } else {
        rest.push_back(std::move(message));
      }
    }
    effects.after_commit = std::move(rest);
  }
  pending_.push_back({std::move(effects.writes), std::move(effects.after_commit), std::move(replies)});
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
  const Duration full =
      writes && !bugs_.drop_when_full ? std::max(Duration{0}, Duration(disk_full_until_ - now_)) : Duration{0};
  const Duration latency = !writes                          ? Duration{0}
                           : now_ < disk_slow_until_        ? random_.seconds_between(0.5, 3)
                           : !race_ && random_.chance(0.05) ? random_.seconds_between(0.1, 0.5)
                                                            : random_.seconds_between(0.002, 0.02);
  after(full + latency, [this, life] {
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
  if (bugs_.drop_when_full && now_ < disk_full_until_) {
    ops.clear();
  }
  if (const auto wrong = disk_.apply(epoch_, ops)) {
    fail(*wrong);
    return;
  }
  note_stored(ops);
  if (chaos_.restarts && chaos_now() && random_.chance(0.002)) {
    crash_server(false);  // between the commit and what depends on it
    return;
  }
  for (Pending& each : done) {
    if (!coordinator_) {
      return;  // killed by what a client asked next
    }
    coordinator_->grants_sent(leases_granted(each.after_commit), now_);
    for (Outgoing& message : each.after_commit) {
      server_sends(std::move(message));
    }
    for (const Action& reply : each.replies) {
      reply();
    }
  }
  plan_server_tick();
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
      on_server([&](Effects& effects) { coordinator_->tick(now_, unix_ms(), effects); });
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
  for (const LeaseId lease : leases_granted(std::span(&message, 1))) {
    sent_.insert(lease);
  }
  if (const auto* ack = std::get_if<ResultAck>(&message.message)) {
    check_ack(*stream, *ack);
    if (bugs_.lose_acknowledgements) {
      return;
    }
  }
  deliver(stream, message.message);
}

void FarmSimulation::deliver(const std::shared_ptr<Stream>& stream, const CoordinatorMessage& message) {
  if (stream->broken || (bugs_.lose_what_is_cut && now_ < stream->cut_down)) {
    return;
  }
  const int times = chaos_.repeats && random_.chance(0.05) ? 2 : 1;
  for (int i = 0; i < times; ++i) {
    const Duration delay =
        !race_ && random_.chance(0.02) ? random_.seconds_between(0.1, 1) : random_.seconds_between(0.0002, 0.005);
    stream->last_down = std::max({stream->last_down, now_ + delay, stream->cut_down});
    at(stream->last_down, [this, stream, content = message] {
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

void FarmSimulation::server_receives(const std::shared_ptr<Stream>& stream, WorkerMessage message) {
  if (deposed_ && stream->server_life == deposed_->life && !stream->broken) {
    deposed_->inbox.emplace_back(stream, std::move(message));
    return;
  }
  if ((stream->broken && !stream->lingers) || stream->server_life != server_life_ || !coordinator_) {
    return;
  }
  if (auto* result = std::get_if<WorkerResult>(&message)) {
    last_result_[{stream->session, result->key}] = result->render_digest;
    trace("{} sends job {}, tile {}, samples [{}, {})", workers_[stream->worker].name, result->key.job.value,
          result->key.tile.value, result->key.range.first(), result->key.range.end());
    const Film* const film = coordinator_->film(result->key.job);
    if (bugs_.repeat_results) {
      result->node = first_results_.try_emplace(result->key, result->node).first->second;
      result->hash = hash_of(result->node);
    }
    if (bugs_.trust_hashes) {
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
      if (bugs_.ignore_machines) {
        hello->machine = hello->name;
      }
      on_server([&](Effects& effects) {
        coordinator_->worker_connected(stream->session, *hello, now_, effects);
        const bool dismissed = std::ranges::any_of(effects.after_commit, [&](const Outgoing& sent) {
          return sent.to == stream->session && std::holds_alternative<Dismissal>(sent.message);
        });
        if (!dismissed) {  // else its name is that of another one, which is here
          brought_[hello->name] = hello->held.size();
          for (const HeldLease& held : hello->held) {
            sent_.insert(held.lease);
          }
        }
      });
    } else {
      fail("a stream does not begin with a hello");
    }
    return;
  }
  on_server([&](Effects& effects) {
    coordinator_->worker_message(stream->session, std::move(message), now_, unix_ms(), effects);
  });
}

}  // namespace lightmill::simulation
