#include "server/domain/lease_table.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/number_text.h"

namespace lightmill {
namespace {

/// Factor for leases_per_worker while a worker's units have fewer tiles than its threads need.
constexpr std::uint32_t kSmallUnitsFactor = 8;

}  // namespace

const Lease* LeaseTable::find(LeaseId id) const {
  const auto found = leases_.find(id);
  return found == leases_.end() ? nullptr : &found->second;
}

bool LeaseTable::is_oldest(const Lease& lease) const {
  return *workers_.at(lease.worker).leases().begin() == lease.id;
}

bool LeaseTable::is_idle(const Lease& lease, Time now) const {
  return is_oldest(lease) && now >= lease.last_progress + limits_.result_timeout();
}

bool LeaseTable::is_preparation(const Lease& lease) const {
  return lease.is_pilot() || !workers_.at(lease.worker).find_job(lease.unit.job)->delivered;
}

void LeaseTable::prepared(LeaseId id, double rendering_seconds, Time now) {
  const Lease& lease = leases_.at(id);
  if (is_worked_on(lease)) {
    queue_.add_preparation(jobs_.at(lease.unit.job), to_seconds(now - lease.last_progress) - rendering_seconds, now);
  }
}

bool LeaseTable::wants_more(const Worker& worker) const {
  if (!worker.counts() || worker.silent()) {
    return false;
  }
  const std::size_t held = worker.leases().size();
  if (held == 1 && leases_.at(*worker.leases().begin()).alone) {
    return false;
  }
  const std::uint32_t wanted = limits_.leases_per_worker;
  return held < wanted ||
         (worker.tiles_out() < worker.threads() * wanted && held < std::size_t{wanted} * kSmallUnitsFactor);
}

// ---- opening and sending ----

const Lease& LeaseTable::open(Worker& worker, Job& job, Lease opened, Time now) {
  Lease& lease = leases_[opened.id];
  lease = std::move(opened);
  lease.worker = worker.name();
  lease.worker_since = worker.connected_at();
  lease.done.assign(lease.unit.tiles.size(), false);
  lease.remaining = static_cast<std::uint32_t>(lease.unit.tiles.size());
  lease.granted = lease.last_progress = now;
  set_deadline(lease, now + limits_.lease_duration);
  job.lease_opened(lease, now);
  worker.lent(lease);
  ++totals_.leases_granted;
  return lease;
}

void LeaseTable::send_grant(Worker& worker, Job& job, LeaseId id, const Event& event) {
  // A grant waits for a commit in these cases:
  // - The job's class is not stored. Later leases for the same worker wait too: they must not overtake the description.
  // - The job has an error goal. The film that decided the sample count must be stored. Else samples could come back
  //   after a crash that are not decided yet.
  // - Results were acknowledged but not merged. The grant must not overtake the acknowledgement, because a worker does
  //   not render samples of which it holds a result.
  WorkerJob& known = worker.job(job.id());
  const bool count_is_fixed = job.spec().goal.error == 0;
  const bool at_once =
      count_is_fixed && !job.has_unkept_results() && job.digest_is_durable() && (known.confirmed || known.leases == 1);
  std::vector<Outgoing>& channel = at_once ? event.effects.now : event.effects.after_commit;
  if (known.leases == 1 || known.describe) {
    channel.push_back({*worker.session(), JobDescription{job.id(), job.digest(), job.spec().settings}});
    known.describe = false;
  }
  LeaseGrant grant{id, leases_.at(id).unit, trace_id(job.spec().request_id)};
  for (const TileId tile : grant.unit.tiles) {
    grant.tags.push_back(signer_.tag(worker.name(), id, job.digest(), {job.id(), tile, grant.unit.range}));
  }
  channel.push_back({*worker.session(), std::move(grant)});
  if (!at_once) {
    wait_for_commit(worker, job, id);
  }
}

void LeaseTable::wait_for_commit(const Worker& worker, Job& job, LeaseId id) {
  Lease& lease = leases_.at(id);
  lease.sent = false;
  lease.waits_for = *worker.session();
  set_deadline(lease, Time::max());
  job.lease_waits();
}

void LeaseTable::was_sent(LeaseId id, Time now) {
  Lease& lease = leases_.at(id);
  if (!lease.sent) {
    lease.sent = true;
    lease.granted = lease.last_progress = now;
    renew(id, now);
    jobs_.at(lease.unit.job).lease_sent(now);
  }
}

void LeaseTable::grants_sent(std::span<const LeaseId> leases, Time now) {
  for (const LeaseId id : leases) {
    // A worker whose stream broke got nothing.
    if (const Lease* const lease = find(id);
        lease != nullptr && workers_.at(lease->worker).session() == lease->waits_for) {
      was_sent(id, now);
    }
  }
}

// ---- progress and end ----

bool LeaseTable::finish_tile(LeaseId id, TileId tile) {
  const auto found = leases_.find(id);
  if (found == leases_.end()) {
    return false;
  }
  Lease& lease = found->second;
  const auto at = std::ranges::lower_bound(lease.unit.tiles, tile);
  if (at == lease.unit.tiles.end() || *at != tile) {
    return false;
  }
  const auto index = static_cast<std::size_t>(at - lease.unit.tiles.begin());
  if (lease.done[index]) {
    return false;
  }
  lease.done[index] = true;
  --lease.remaining;
  return true;
}

void LeaseTable::tile_done(LeaseId id, TileId tile, bool by_its_worker, const Event& event) {
  if (!finish_tile(id, tile)) {
    return;
  }
  Lease& lease = leases_.at(id);
  Worker& worker = workers_.at(lease.worker);
  if (by_its_worker) {
    lease.last_progress = event.now;
  } else {
    note_silence(worker, lease, event.now);
  }
  worker.tile_done();
  if (lease.remaining == 0) {
    worker.unit_done();
    end(id, {.cancel = !by_its_worker}, event);
  }
}

void LeaseTable::note_silence(Worker& worker, const Lease& lease, Time now) const {
  if (lease.id != *worker.leases().begin() || lease.abandoned || !lease.sent) {
    return;  // a worker works on its oldest lease, once it has it
  }
  const double silent = to_seconds(now - std::max(worker.result_at(), lease.granted));
  const auto waited_for = std::ranges::find(lease.done, false) - lease.done.begin();
  const TileId tile = lease.unit.tiles[static_cast<std::size_t>(waited_for) % lease.unit.tiles.size()];
  const Job& job = jobs_.at(lease.unit.job);
  const auto pixel_samples = static_cast<double>(lease.unit.range.count() * job.pixels_of(tile));
  worker.job(job.id()).cost.mean.expect(silent / pixel_samples);
}

void LeaseTable::settle(Job& job, const NodeKey& merged, LeaseId from, const Event& event) {
  for (const JobPlan::Hold& hold : job.plan().settle(merged.tile, merged.range)) {
    tile_done(hold.lease, hold.tile, from == hold.lease, event);
  }
}

void LeaseTable::audit_done(LeaseId id, TileId tile, const Event& event) {
  if (const Lease* const lease = find(id); lease != nullptr && lease->audits) {
    jobs_.at(lease->unit.job).audits().release({lease->unit.range, tile}, id, nullptr);
    tile_done(id, tile, true, event);
  }
}

void LeaseTable::audited_by(const Worker& worker, const NodeKey& key, const Event& event) {
  for (const LeaseId id : std::vector(worker.leases().begin(), worker.leases().end())) {
    const Unit& unit = leases_.at(id).unit;
    if (unit.job == key.job && unit.range == key.range && std::ranges::binary_search(unit.tiles, key.tile)) {
      audit_done(id, key.tile, event);
    }
  }
}

void LeaseTable::give_up_tile(LeaseId id, TileId tile, const Event& event) {
  if (const Lease* const lease = find(id)) {
    Job& job = jobs_.at(lease->unit.job);
    const SampleRange range = lease->unit.range;
    audit_done(id, tile, event);
    job.plan().release(id, tile, range);
    tile_done(id, tile, true, event);
  }
}

void LeaseTable::end(LeaseId id, End how, const Event& event) {
  const auto found = leases_.find(id);
  LM_CHECK(found != leases_.end());
  const Lease lease = std::move(found->second);
  leases_.erase(found);
  expiry_.erase({lease.deadline, id});
  const bool lost = how.lost && lease.sent;  // a worker cannot lose an unsent lease
  Job& job = jobs_.at(lease.unit.job);
  Worker& worker = workers_.at(lease.worker);
  for (std::size_t i = 0; i < lease.unit.tiles.size(); ++i) {
    if (!lease.done[i] && lease.audits) {
      job.audits().release({lease.unit.range, lease.unit.tiles[i]}, id, lost ? &worker.identity() : nullptr);
    } else if (!lease.done[i]) {
      job.plan().release(id, lease.unit.tiles[i], lease.unit.range);
    }
  }
  const bool was_oldest = is_oldest(lease);
  if (was_oldest && !lease.audits && (lost || (how.cancel && lease.remaining > 0))) {
    // One thread, because a worker may claim many that it does not have.
    queue_.add_lost(job, to_seconds(event.now - lease.last_progress));
  }
  if (lease.sent && (was_oldest || lease.is_pilot()) && (lease.is_pilot() || lease.remaining > 0) &&
      is_preparation(lease)) {
    queue_.add_preparation(job, to_seconds(event.now - lease.last_progress), event.now);
  }
  worker.ended(lease);
  if (was_oldest && !worker.leases().empty()) {
    leases_.at(*worker.leases().begin()).last_progress = event.now;  // the worker starts it now
  }
  job.lease_ended(lease, lost, event.now);
  if (lost) {
    worker.lost(lease, event.now);
    ++totals_.leases_lost;
    event.warn(about(job.id(), lease.worker, id), "worker {} lost lease {} of job {}: {} will be leased again",
               lease.worker, id.value, job.id().value,
               lease.is_pilot() ? std::string("its pilot")
                                : fmt::format("samples [{}, {}) of {}", lease.unit.range.first(),
                                              lease.unit.range.end(), counted(lease.remaining, "tile")));
  }
  if (how.cancel && worker.session()) {
    event.send_after_commit(*worker.session(), LeaseCancel{{id}});
  }
  if (wants_more(worker)) {
    workers_.set_idle(worker, true);  // it is served without a request
  }
  queue_.refresh(job);
}

// ---- time ----

void LeaseTable::set_deadline(Lease& lease, Time deadline) {
  expiry_.erase({lease.deadline, lease.id});
  lease.deadline = deadline;
  if (deadline != Time::max()) {
    expiry_.insert({lease.deadline, lease.id});
  }
}

void LeaseTable::renew(LeaseId id, Time now) {
  if (Lease& lease = leases_.at(id); lease.sent) {
    const Time idle_at = is_oldest(lease) ? lease.last_progress + limits_.result_timeout() : Time::max();
    set_deadline(lease, std::min(now + limits_.lease_duration, idle_at));
  }
}

void LeaseTable::abandon(const Worker& worker, Time now) {
  for (const LeaseId id : worker.leases()) {
    Lease& lease = leases_.at(id);
    lease.abandoned = true;
    set_deadline(lease, std::min(lease.deadline, now + limits_.disconnect_grace));
  }
}

void LeaseTable::resume(LeaseId id, Time now) {
  leases_.at(id).abandoned = false;
  was_sent(id, now);
  renew(id, now);
}

void LeaseTable::extend_all(Duration late, Time now) {
  for (auto& [id, lease] : leases_) {
    lease.last_progress = std::min(lease.last_progress + late, now);
    const Duration duration = lease.abandoned ? limits_.disconnect_grace : limits_.lease_duration;
    set_deadline(lease, std::max(lease.deadline, now + duration));
  }
}

std::optional<LeaseId> LeaseTable::next_expired(Time now) {
  const Time kept_until = workers_.backlog_at() + limits_.lease_duration;
  while (!expiry_.empty() && expiry_.begin()->first <= now) {
    const LeaseId id = expiry_.begin()->second;
    Lease& lease = leases_.at(id);
    if (lease.abandoned || kept_until <= now) {
      return id;
    }
    set_deadline(lease, kept_until);
  }
  return std::nullopt;
}

std::optional<Time> LeaseTable::next_deadline() const {
  return expiry_.empty() ? std::nullopt : std::optional(expiry_.begin()->first);
}

}  // namespace lightmill
