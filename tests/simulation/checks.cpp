#include "tests/simulation/checks.h"

#include <algorithm>

#include "server/domain/job_figures.h"

namespace lightmill::simulation {

void Checks::server_starts(const StoredState& stored) {
  merged_by_.clear();
  refusals_.server_starts();
  losses_.server_starts();
  for (const StoredState::StoredJob& job : stored.jobs) {
    for (const StoredState::StoredResult& result : job.results) {
      merged_by_[{job.record.id, result.tile, result.range}] = stored.renderers.at(result.by);
    }
  }
  for (const NodeKey& key : stored.damaged) {
    std::erase_if(acknowledged_, [&](const NodeKey& each) {
      return each.job == key.job && each.tile == key.tile && key.range.contains(each.range);
    });
  }
}

void Checks::hello_came(const std::shared_ptr<Stream>& stream, const WorkerHello& hello) {
  brought_[hello.name] = hello.held.size();
  losses_.hello_came(stream, hello);
  refusals_.hello_came(*stream);
}

void Checks::result_came(const Stream& stream, const WorkerResult& result) {
  last_result_[{stream.session, result.key}] = result.render_digest;
}

void Checks::check_effects(const Effects& effects) {
  note_writes(effects);
  note_grants(effects);
  check_decisions(effects);
  refusals_.check(effects);
  losses_.check(effects);
  times_.check(effects);
  note_unwanted(effects);
}

void Checks::check_sent(const std::shared_ptr<Stream>& stream, const Outgoing& message) {
  if (const auto* grant = std::get_if<LeaseGrant>(&message.message)) {
    check_grant(*stream, *grant);
  } else if (const auto* ack = std::get_if<ResultAck>(&message.message)) {
    check_ack(*stream, *ack);
  }
  losses_.sent(stream, message);
}

void Checks::check_grant(const Stream& stream, const LeaseGrant& grant) {
  if (const auto then = unbound_then_.find(grant.lease);
      then != unbound_then_.end() && then->second != unbound_[grant.unit.job]) {
    return;
  }
  const JobRecord* const stored = server_.disk().job(grant.unit.job);
  if (stored == nullptr || stored->fingerprint_class.empty()) {
    world_.fail(
        fmt::format("lease {} is sent before the class of job {} is stored", grant.lease.value, grant.unit.job.value));
    return;
  }
  if (!stored->method_notes.candidates.empty()) {
    world_.fail(
        fmt::format("lease {} is sent before the method of job {} is stored", grant.lease.value, grant.unit.job.value));
    return;
  }
  const SimulatedWorker& to = workers_[stream.worker];
  if (stored->fingerprint_class != (stored->spec.allow_mixed ? kMixedClass : to.fingerprint)) {
    world_.fail(
        fmt::format("lease {} goes to a worker of class {}", grant.lease.value, workers_[stream.worker].fingerprint));
  }
}

bool Checks::may_verify(SessionId session, const NodeKey& key) const {
  const auto stream = server_.streams().find(session);
  const auto by = merged_by_.find(key);
  if (by == merged_by_.end()) {
    return workers_.have_liars();  // a copy differs from the joined node there
  }
  if (stream == server_.streams().end()) {
    return false;
  }
  const SimulatedWorker& to = workers_[stream->second->worker];
  const bool comparable = by->second.fingerprint_class.empty() || world_.bugs.hide_classes ||
                          by->second.fingerprint_class == to.fingerprint;
  return comparable && to.identity != by->second.identity;
}

void Checks::note_writes(const Effects& effects) {
  for (const StoreOp& op : effects.writes) {
    if (const auto* job = std::get_if<PutJob>(&op)) {
      unbound_[job->record.id] += job->record.fingerprint_class.empty() ? 1 : 0;
    } else if (const auto* result = std::get_if<PutResult>(&op)) {
      merged_by_[result->key] = result->by;
      if (workers_.in_deceit(result->key)) {
        world_.report.deceit_parts +=
            parts_of(*server_.coordinator()->outline(result->key.job), world_.race->samples, result->key);
      }
      if (!granted_.contains({result->by.worker, result->key})) {
        world_.fail(fmt::format("job {}, tile {}: samples [{}, {}) enter the film, but were never granted to {}",
                                result->key.job.value, result->key.tile.value, result->key.range.first(),
                                result->key.range.end(), result->by.worker));
      }
    } else if (const auto* drop = std::get_if<DropResults>(&op)) {
      dropped_.push_back(drop->key);
    } else if (const auto* held = std::get_if<PutQuarantine>(&op);
               held != nullptr && !held->record.reason.starts_with(kByHand)) {
      ++world_.report.quarantined;
      if (!is_of_lies(held->record.of.identity) && !world_.bugs.wrong_bits) {
        world_.fail(
            fmt::format("{} is in quarantine, but has not lied: {}", held->record.of.worker, held->record.reason));
      }
    }
  }
}

void Checks::note_grants(const Effects& effects) {
  for (const Outgoing& message : effects.after_commit) {
    if (const auto* grant = std::get_if<LeaseGrant>(&message.message)) {
      unbound_then_[grant->lease] = unbound_[grant->unit.job];
    }
  }
}

void Checks::stored(std::span<const StoreOp> ops) {
  for (const StoreOp& op : ops) {
    if (const auto* drop = std::get_if<DropResults>(&op)) {
      std::erase_if(acknowledged_, [&](const NodeKey& key) {
        return key.job == drop->key.job && key.tile == drop->key.tile && drop->key.range.contains(key.range);
      });
    } else if (const auto* audited = std::get_if<PutAudited>(&op)) {
      if (const FilmOutline* film =
              server_.coordinator() ? server_.coordinator()->outline(audited->key.job) : nullptr) {
        world_.report.audited += audited->key.range.count() *
                                 static_cast<std::uint64_t>(film->grid().tile_rect(audited->key.tile).pixel_count());
      }
    }
  }
}

void Checks::check_decisions(const Effects& effects) {
  bool granted = false;
  for (const std::vector<Outgoing>* channel : {&effects.now, &effects.after_commit}) {
    for (const Outgoing& message : *channel) {
      const auto* grant = std::get_if<LeaseGrant>(&message.message);
      const FilmOutline* film = grant != nullptr ? server_.coordinator()->outline(grant->unit.job) : nullptr;
      if (film == nullptr) {
        continue;
      }
      granted = true;
      const auto to = server_.streams().find(message.to);
      for (const TileId tile : grant->unit.tiles) {
        if (to != server_.streams().end()) {
          granted_.insert({to->second->name, {grant->unit.job, tile, grant->unit.range}});
        }
        if (film->covered(tile, grant->unit.range) &&
            !may_verify(message.to, {grant->unit.job, tile, grant->unit.range})) {
          world_.fail(fmt::format("lease {} has samples [{}, {}) of tile {}, which are merged", grant->lease.value,
                                  grant->unit.range.first(), grant->unit.range.end(), tile.value));
        }
      }
    }
  }
  if (granted) {
    for (const WorkerStatus& worker : server_.coordinator()->workers(world_.now)) {
      if (!worker.quarantine.empty() && worker.leases > 0) {
        world_.fail(fmt::format("{} is in quarantine with {} leases", worker.name, worker.leases));
      }
      if (worker.leases > 8 * server_.limits().leases_per_worker + brought_[worker.name]) {
        world_.fail(fmt::format("{} has {} leases", worker.name, worker.leases));
      }
    }
  }
}

/// Notes which results are unwanted when the coordinator decides. Before the acknowledgement a client may raise a count
/// or extend a job that ended by time, and a class may be fixed.
void Checks::note_unwanted(const Effects& effects) {
  for (const Outgoing& message : effects.after_commit) {
    if (const auto* ack = std::get_if<ResultAck>(&message.message)) {
      const auto stream = server_.streams().find(message.to);
      const auto all = server_.coordinator()->workers(world_.now);
      // A worker that is gone is not listed, but its machine may still be in quarantine.
      const bool disbelieved =
          stream != server_.streams().end() &&
          (std::ranges::any_of(all,
                               [&](const WorkerStatus& worker) {
                                 return worker.name == stream->second->name && !worker.quarantine.empty();
                               }) ||
           std::ranges::any_of(server_.disk().quarantine(), [&](const auto& entry) {
             return entry.second.of.identity == workers_[stream->second->worker].identity;
           }));
      for (const NodeKey& key : ack->keys) {
        if (disbelieved ||
            (stream != server_.streams().end() && workers_[stream->second->worker].lies != Lies::never)) {
          unwanted_.insert({message.to, key});
          continue;
        }
        const auto status = server_.coordinator()->decided_status(key.job, world_.now);
        if (!status.ok()) {
          continue;
        }
        const FilmOutline& film = *server_.coordinator()->outline(key.job);
        const bool beyond = status->spec.goal.samples > 0 &&
                            key.range.end() > film.allocation().of_tile(key.tile, status->spec.goal.samples),
                   too_late = status->state == JobState::done && status->spec.goal.seconds > 0 &&
                              !film.covered(key.tile, key.range);
        const bool of_former_class = status->fingerprint_class.empty();  // perhaps also of the next class
        if (beyond || too_late || of_former_class) {
          unwanted_.insert({message.to, key});
        }
      }
    }
  }
}

void Checks::check_ack(const Stream& stream, const ResultAck& ack) {
  for (const NodeKey& key : ack.keys) {
    if (const auto unwanted = unwanted_.find({stream.session, key}); unwanted != unwanted_.end()) {
      unwanted_.erase(unwanted);
      continue;
    }
    const JobRecord* const stored = server_.disk().job(key.job);
    if (stored == nullptr || stored->state == JobState::cancelled || stored->state == JobState::failed ||
        stored->fingerprint_class.empty() ||
        (stored->spec.goal.samples > 0 &&
         key.range.end() > stored->allocation.of_tile(key.tile, stored->spec.goal.samples))) {
      continue;  // not wanted
    }
    const auto digest = last_result_.find({stream.session, key});
    if (digest == last_result_.end()) {
      world_.fail("an acknowledgement of a result that was never sent");
      return;
    }
    const bool of_this_job = digest->second == render_digest(stored->spec.settings, stored->fingerprint_class);
    if (of_this_job && server_.disk().covers(key)) {
      acknowledged_.insert(key);
    }
    // With an error goal, fewer samples are wanted again after some are dropped.
    const bool dropped =
        std::ranges::any_of(dropped_,
                            [&](const NodeKey& each) {
                              return each.job == key.job && (stored->spec.goal.error > 0 ||
                                                             (each.tile == key.tile && each.range.contains(key.range)));
                            }) ||
        (stored->spec.goal.error > 0 &&
         std::ranges::any_of(server_.damaged(), [&](const auto& each) { return each.first == key.job; }));
    if (of_this_job && !dropped && !server_.disk().covers(key)) {
      world_.fail(fmt::format("job {}, tile {}, samples [{}, {}) are acknowledged but not durable", key.job.value,
                              key.tile.value, key.range.first(), key.range.end()));
    }
  }
}

void Checks::check_shown_ends() {
  for (const JobStatus& job : server_.coordinator()->jobs(world_.now)) {
    const JobRecord* const stored = server_.disk().job(job.id);
    if (has_ended(job.state) && (stored == nullptr || stored->state != job.state)) {
      world_.fail(fmt::format("clients see that job {} is {}, but this is not stored", job.id.value,
                              lightmill::name_of(job.state)));
    }
  }
}

void Checks::check_acknowledged_is_durable() {
  for (const NodeKey& key : acknowledged_) {
    if (server_.disk().job(key.job) != nullptr && !server_.disk().covers(key)) {
      world_.fail(fmt::format("job {}, tile {}, samples [{}, {}) were acknowledged, but are no longer on disk",
                              key.job.value, key.tile.value, key.range.first(), key.range.end()));
      return;
    }
  }
}

}  // namespace lightmill::simulation
