#include "tests/simulation/server_side.h"

#include <algorithm>

#include "server/domain/grant_signer.h"
#include "server/store/check_rows.h"
#include "tests/simulation/checks.h"
#include "tests/simulation/client_side.h"
#include "tests/simulation/effects_text.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

StoredState ServerSide::load_checked() {
  checks_.check_acknowledged_is_durable();
  StoredState state = disk_.load(world_.bugs.hide_damage);
  epoch_ = state.epoch;
  std::vector<StoreOp> repairs;
  if (const Status status = remove_invalid_rows(state, repairs); !status.ok() || !repairs.empty()) {
    world_.fail(fmt::format("a coordinator stored rows that it cannot load: {}",
                            status.ok() ? fmt::format("{} rows", repairs.size()) : message_of(status)));
  }
  if (world_.bugs.forget_jobs && state.jobs.size() > 1 && world_.chaos_now()) {
    state.jobs.pop_back();
  }
  if (world_.bugs.forget_quarantine) {
    state.quarantine.clear();
  }
  return state;
}

void ServerSide::start() {
  ++life_;
  world_.trace("a coordinator starts");
  StoredState stored = load_checked();
  checks_.server_starts(stored);
  for (const NodeKey& key : stored.damaged) {
    damaged_.insert({key.job, key.tile});
  }
  coordinator_ = std::make_unique<Coordinator>(limits_, std::move(stored), world_.now);
  next_tick_ = Time::max();
  plan_tick();
  const std::vector<WorkerStatus> known = coordinator_->workers(world_.now);
  for (const auto& [worker, record] : disk_.quarantine()) {
    if (std::ranges::none_of(
            known, [&](const WorkerStatus& each) { return each.name == worker && each.quarantine == record.reason; })) {
      world_.fail(fmt::format("a coordinator starts and does not know of {}'s quarantine", worker));
    }
  }
  if (world_.now < disk_full_until_) {
    call([&](Effects& effects) { coordinator_->hold("the disk is full", world_.now, effects); });
  }
}

void ServerSide::crash(bool commit_lands) {
  if (!coordinator_) {
    return;
  }
  ++world_.report.restarts;
  world_.trace("the coordinator is killed");
  checks_.check_shown_ends();
  ++life_;
  coordinator_.reset();
  clients_.lose_inspections();
  abandon_commits(commit_lands);
  damage_disk();
  for (const auto& [session, stream] : streams_) {
    workers_.break_stream(stream);
  }
  streams_.clear();
  pending_.clear();
  film_waits_.clear();
  world_.after(world_.random.seconds_between(0.05, 3), [this] { start(); });
}

void ServerSide::abandon_commits(bool commit_lands) {
  commit_lands = commit_lands && world_.now >= disk_full_until_;
  std::vector<StoreOp> ops;
  for (Pending& each : committing_) {
    ops.insert(ops.end(), each.writes.begin(), each.writes.end());
  }
  committing_.clear();
  if (world_.bugs.torn_commits) {
    ops.resize(ops.size() / 2);
    commit_lands = true;
  }
  if (commit_lands) {
    if (const auto wrong = disk_.apply(epoch_, ops)) {
      world_.fail(*wrong);
      return;
    }
    checks_.stored(ops);
  }
}

void ServerSide::call(const std::function<void(Effects&)>& call) {
  if (!coordinator_) {
    return;
  }
  Effects effects;
  call(effects);
  execute(std::move(effects), {});
}

void ServerSide::note_effects(const Effects& effects, const Coordinator& coordinator) {
  if (hash_) {
    const std::string text = effects_text(effects) + view_text(coordinator, world_.now);
    hash_->append(as_byte_view(text));
    world_.trace("{}", text);
  }
}

void ServerSide::execute(Effects effects, std::vector<Action> replies) {
  if (world_.bugs.show_unstored_ends) {
    coordinator_->ends_stored(ends_in(effects.writes));
  }
  note_effects(effects, *coordinator_);
  clients_.note_inspected(effects);
  checks_.check_effects(effects);
  for (const Note& note : effects.notes) {
    world_.trace("{}", note.text);
  }
  for (Outgoing& message : effects.now) {
    send(std::move(message));
  }
  checks_.check_losses(effects);
  for (const SessionId session : effects.closed) {
    if (const auto found = streams_.find(session); found != streams_.end()) {
      workers_.break_stream(found->second);
    }
  }
  if (world_.bugs.acknowledge_before_commit || world_.bugs.lease_before_commit || world_.bugs.blame_unsent) {
    std::vector<Outgoing> rest;
    if (world_.bugs.lease_before_commit || world_.bugs.blame_unsent) {
      coordinator_->grants_sent(leases_granted(effects.after_commit), world_.now);
    }
    for (Outgoing& message : effects.after_commit) {
      const bool is_ack = std::holds_alternative<ResultAck>(message.message);
      if (is_ack ? world_.bugs.acknowledge_before_commit : world_.bugs.lease_before_commit) {
        send(std::move(message));
      } else {
        rest.push_back(std::move(message));
      }
    }
    effects.after_commit = std::move(rest);
  }
  pending_.push_back(
      {std::move(effects.writes), std::move(effects.after_commit), std::move(replies), std::move(effects.film_reads)});
  if (committing_.empty()) {
    start_commit();
  }
  plan_tick();
  tell_films(effects);
}

void ServerSide::start_commit() {
  if (pending_.empty()) {
    return;
  }
  // Group commit: all pending effects share a transaction, or only the first few.
  const std::size_t count =
      world_.chaos.restarts && world_.random.chance(0.3) ? 1 + world_.random.below(pending_.size()) : pending_.size();
  bool writes = false;
  for (std::size_t i = 0; i < count; ++i) {
    writes = writes || !pending_.front().writes.empty();
    committing_.push_back(std::move(pending_.front()));
    pending_.pop_front();
  }
  const std::uint64_t life = life_;
  if (writes && crash_at_commit_.erase(++commits_) > 0) {
    crash(world_.random.chance(0.5));
    return;
  }
  const Duration full = writes && !world_.bugs.drop_when_full
                            ? std::max(Duration{0}, Duration(disk_full_until_ - world_.now))
                            : Duration{0};
  const Duration latency = !writes                                      ? Duration{0}
                           : world_.now < disk_slow_until_              ? world_.random.seconds_between(0.5, 3)
                           : !world_.race && world_.random.chance(0.05) ? world_.random.seconds_between(0.1, 0.5)
                                                                        : world_.random.seconds_between(0.002, 0.02);
  world_.after(full + latency, [this, life] {
    if (life == life_) {
      finish_commit();
    }
  });
}

void ServerSide::finish_commit() {
  std::vector<Pending> done = std::exchange(committing_, {});
  std::vector<StoreOp> ops;
  std::vector<JobId> ended;
  for (Pending& each : done) {
    std::ranges::move(ends_in(each.writes), std::back_inserter(ended));
    for (StoreOp& op : each.writes) {
      const bool lost =
          (world_.bugs.lose_a_write && std::holds_alternative<PutNode>(op) && world_.random.chance(0.05)) ||
          (world_.bugs.keep_joined_nodes && std::holds_alternative<DropNode>(op)) ||
          (world_.bugs.keep_dropped_results && std::holds_alternative<DropResults>(op));
      if (auto* result = std::get_if<PutResult>(&op); result != nullptr && world_.bugs.lose_audits) {
        result->audit_pending = false;
      }
      if (!lost) {
        ops.push_back(std::move(op));
      }
    }
  }
  if (world_.bugs.drop_when_full && world_.now < disk_full_until_) {
    ops.clear();
  }
  if (const auto wrong = disk_.apply(epoch_, ops)) {
    world_.fail(*wrong);
    return;
  }
  checks_.stored(ops);
  if (world_.chaos.restarts && world_.chaos_now() && world_.random.chance(0.002)) {
    crash(false);  // between the commit and its messages
    return;
  }
  if (!world_.bugs.show_unstored_ends) {
    coordinator_->ends_stored(ended);
  }
  for (Pending& each : done) {
    if (!coordinator_) {
      return;  // killed by the next request of a client
    }
    coordinator_->grants_sent(leases_granted(each.after_commit), world_.now);
    for (Outgoing& message : each.after_commit) {
      send(std::move(message));
    }
    for (const Action& reply : each.replies) {
      reply();
    }
    for (const JobId job : world_.bugs.lose_films ? std::vector<JobId>{} : each.film_reads) {
      read_film(std::make_shared<FilmRead>(FilmRead{job, {}, {}}));
    }
  }
  plan_tick();
  start_commit();
}

void ServerSide::plan_tick() {
  if (!coordinator_ || world_.bugs.never_requeue) {
    return;  // without ticks no lease ever expires
  }
  const std::optional<Time> next = coordinator_->next_deadline();
  if (!next || *next >= next_tick_) {
    return;
  }
  next_tick_ = std::max(*next, world_.now);
  const std::uint64_t life = life_;
  world_.at(next_tick_, [this, life, time = next_tick_] {
    if (life == life_ && time == next_tick_) {
      next_tick_ = Time::max();
      call([&](Effects& effects) { coordinator_->tick(world_.now, world_.unix_ms(), effects); });
    }
  });
}

void ServerSide::send(Outgoing message) {
  const auto found = streams_.find(message.to);
  if (found == streams_.end()) {
    return;
  }
  const std::shared_ptr<Stream> stream = found->second;
  if (const auto* grant = std::get_if<LeaseGrant>(&message.message)) {
    world_.trace("lease {} to {}: job {}, samples [{}, {}) of {} tiles from {}", grant->lease.value,
                 workers_[stream->worker].name, grant->unit.job.value, grant->unit.range.first(),
                 grant->unit.range.end(), grant->unit.tiles.size(), grant->unit.tiles[0].value);
  }
  checks_.check_sent(stream, message);
  if (!world_.bugs.lose_acknowledgements || !std::holds_alternative<ResultAck>(message.message)) {
    deliver(stream, message.message);
  }
}

void ServerSide::deliver(const std::shared_ptr<Stream>& stream, const CoordinatorMessage& message) {
  if (stream->broken || (world_.bugs.lose_what_is_cut && world_.now < stream->cut_down)) {
    return;
  }
  const int times = world_.chaos.repeats && world_.random.chance(0.05) ? 2 : 1;
  for (int i = 0; i < times; ++i) {
    const Duration delay = !world_.race && world_.random.chance(0.02) ? world_.random.seconds_between(0.1, 1)
                                                                      : world_.random.seconds_between(0.0002, 0.005);
    stream->last_down = std::max({stream->last_down, world_.now + delay, stream->cut_down});
    world_.at(stream->last_down, [this, stream, content = message] {
      if (stream->broken) {
        return;
      }
      workers_.on_worker(stream->worker, stream->worker_life,
                         [this, stream, content](Session& session, SessionActions& actions) {
                           if (workers_[stream->worker].stream != stream) {
                             return;
                           }
                           if (const auto* ack = std::get_if<ResultAck>(&content)) {
                             workers_.acknowledged(stream->worker, *ack);
                           }
                           session.message(content, world_.now, actions);
                         });
    });
  }
}

void ServerSide::open_stream(const std::shared_ptr<Stream>& stream) {
  stream->server_life = life_;
  stream->session = SessionId{next_session_++};
  streams_[stream->session] = stream;
}

void ServerSide::disconnected(const Stream& stream, SessionId session) {
  if (stream.server_life == life_ && coordinator_) {
    call([&](Effects& effects) { coordinator_->worker_disconnected(session, world_.now, effects); });
    streams_.erase(stream.session);
  }
}

void ServerSide::falsify(const Stream& stream, WorkerResult& result) {
  if (world_.bugs.wrong_beside_lies && workers_[stream.worker].lies == Lies::never &&
      (falsified_.contains(result.key) ||
       std::ranges::any_of(disk_.results(result.key.job, result.key.tile),
                           [](const Disk::Result& each) { return is_of_lies(each.by.identity) && !each.audited; }))) {
    falsified_.insert(result.key);
    result.node.values[0] = std::nextafter(result.node.values[0], 1e30f);
    result.hash = hash_of(result.node);
  }
  if (world_.bugs.repeat_results || (world_.bugs.repeat_after_quarantine && world_.report.quarantined > 0)) {
    result.node = first_results_.try_emplace(result.key, result.node).first->second;
    result.hash = hash_of(result.node);
  }
  if (world_.bugs.trust_hashes) {
    result.hash = hash_of(result.node);
  }
  const auto grant = [&] {  // as if these samples had been granted
    result.tag = GrantSigner(disk_.secret()).tag(stream.name, result.lease, result.render_digest, result.key);
  };
  if (world_.bugs.ignore_grants) {
    grant();
  }
  const FilmOutline* const film = coordinator_->outline(result.key.job);
  if (world_.bugs.merge_twice && film != nullptr && result.key.range.end() < 8 &&
      film->covered(result.key.tile, result.key.range)) {
    // Repeats the result as other samples, like a film that adds duplicates.
    result.key.range.index += 1;
    result.node.range = result.key.range;
    result.hash = hash_of(result.node);
    grant();
    checks_.result_came(stream, result);
  }
}

void ServerSide::receive(const std::shared_ptr<Stream>& stream, WorkerMessage message) {
  if (deposed_ && stream->server_life == deposed_->life && !stream->broken) {
    deposed_->inbox.emplace_back(stream, std::move(message));
    return;
  }
  if ((stream->broken && !stream->lingers) || stream->server_life != life_ || !coordinator_) {
    return;
  }
  if (auto* result = std::get_if<WorkerResult>(&message)) {
    checks_.result_came(*stream, *result);
    world_.trace("{} sends job {}, tile {}, samples [{}, {})", workers_[stream->worker].name, result->key.job.value,
                 result->key.tile.value, result->key.range.first(), result->key.range.end());
    falsify(*stream, *result);
    result->damaged = !has_its_hash(*result);
  }
  if (const auto* refusal = std::get_if<WorkerRefusal>(&message)) {
    checks_.refusal_came(*stream, *refusal);
  }
  if (!stream->said_hello) {
    if (auto* hello = std::get_if<WorkerHello>(&message)) {
      stream->said_hello = true;
      if (workers_.have_certificates() && !world_.bugs.trust_claims) {
        hello->identity = workers_[stream->worker].identity;
      }
      if (world_.bugs.ignore_identities) {
        hello->identity = hello->name;
      }
      call([&](Effects& effects) {
        coordinator_->worker_connected(stream->session, *hello, world_.now, effects);
        const bool dismissed = std::ranges::any_of(effects.after_commit, [&](const Outgoing& sent) {
          return sent.to == stream->session && std::holds_alternative<Dismissal>(sent.message);
        });
        if (!dismissed) {  // else another connected worker has its name
          checks_.hello_came(stream, *hello);
        }
      });
    } else {
      world_.fail("a stream does not begin with a hello");
    }
    return;
  }
  call([&](Effects& effects) {
    coordinator_->worker_message(stream->session, std::move(message), world_.now, world_.unix_ms(), effects);
  });
}

}  // namespace lightmill::simulation
