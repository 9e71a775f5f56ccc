#include "server/domain/scheduler.h"

#include <map>
#include <set>

#include "server/domain/eligibility.h"

namespace lightmill {

void Scheduler::serve(Worker& worker, const Event& event) {
  while (serve_once(worker, event)) {
  }
}

void Scheduler::serve_all(const Event& event) {
  if (queue_.empty()) {
    return;
  }
  std::vector<std::pair<LeaseId, std::string>> waiting;
  for (const std::string& name : workers_.idle()) {
    waiting.emplace_back(workers_.at(name).waits_since(), name);
  }
  std::ranges::sort(waiting);
  while (!waiting.empty() && !queue_.empty()) {
    std::erase_if(waiting, [&](const auto& each) {
      Worker* const worker = workers_.find(each.second);
      return worker == nullptr || !serve_once(*worker, event);
    });
  }
}

void Scheduler::hold(const std::string& why, const Event& event) {
  if (held_ == why) {
    return;
  }
  if (why.empty()) {
    event.info({}, "work is handed out again");
  } else if (held_.empty()) {
    event.warn({}, "no work is handed out: {}", why);
  }
  held_ = why;
  for (const auto& [id, job] : jobs_.all()) {
    if (job->active()) {
      job->touch();
    }
  }
  serve_all(event);
}

bool Scheduler::serve_once(Worker& worker, const Event& event) {
  if (!leases_.wants_more(worker)) {
    workers_.set_idle(worker, false);
    return false;
  }
  const bool granted = held_.empty() && grant_next(worker, event);
  if (!granted) {
    workers_.set_idle(worker, true);
  }
  return granted;
}

bool Scheduler::grant_next(Worker& worker, const Event& event) {
  for (auto at = queue_.begin(); at != queue_.end();) {
    Job& job = jobs_.at(at->job);
    ++at;  // the code below may move or remove the job's entry
    life_cycle_.close_if_time_is_up(job, event);
    if (!queue_.contains(job.id()) || queue_.fell_behind(job, at == queue_.end() ? nullptr : &*at) ||
        !may_have(worker, job, event.now) || !may_start(worker, job)) {
      continue;
    }
    const std::optional<bool> granted = grant(worker, job, event);
    if (!granted || *granted) {
      return granted.has_value();
    }
  }
  return false;
}

bool Scheduler::may_start(const Worker& worker, const Job& job) const {
  if (!job.record().fingerprint_class.empty() || job.spec().allow_mixed || job.spec().verify_share <= 0 ||
      workers_.identities_like(worker) > 1 || !workers_.any_can_audit(worker.hello().renderer_version)) {
    return true;
  }
  if (job.refusals().none() && job.record().counters.leases_lost == 0) {
    return false;
  }
  std::map<std::string_view, std::set<std::string_view>> identities;  // by class, of those that may render it
  for (const auto& [name, other] : workers_.all()) {
    if (other.counts() && may_render(other, job)) {
      identities[other.hello().fingerprint_class].insert(other.identity());
    }
  }
  return std::ranges::none_of(identities, [](const auto& each) { return each.second.size() > 1; });
}

std::optional<bool> Scheduler::grant(Worker& worker, Job& job, const Event& event) {
  if (job.undecided()) {
    if (!job.leases().empty() || !job.plan().has_work() || !Pilots::may_have(worker, job, event.now)) {
      return false;
    }
    if (job.losses().pilot_is_suspect() && !worker.leases().empty()) {
      return std::nullopt;
    }
    pilots_.grant(worker, job, event);
    return true;
  }
  const bool has_work = job.plan().has_work();
  // The first picture comes first, then audits: the sooner wrong results are found, the less is rendered again.
  if (!(has_work && job.plan().first_round()) && grant_audit(worker, job, event)) {
    return true;
  }
  if (!has_work || enough_is_tried(job)) {
    return false;
  }
  const bool alone = job.plan().next_is_alone();
  if (alone && !worker.leases().empty()) {
    return std::nullopt;  // until it has no other leases: other jobs must not give it more
  }
  const LeaseId id = leases_.next_id();
  const UnitAim aim = aim_for(worker, job, event.now);
  if (aim.most_pixel_samples <= 0) {
    return false;
  }
  result_rate_.add_unit(from_seconds(std::max(limits_.unit_seconds, 2 * aim.results_seconds)));
  std::optional<Unit> unit = job.plan().take(job.id(), id, aim);
  if (!unit) {
    queue_.refresh(job);
    return false;
  }
  if (job.record().fingerprint_class.empty()) {
    life_cycle_.start(job, worker, event);
  }
  leases_.open(worker, job, {.id = id, .unit = *std::move(unit), .alone = alone}, event.now);
  leases_.send_grant(worker, job, id, event);
  queue_.refresh(job);
  return true;
}

bool Scheduler::grant_audit(Worker& worker, Job& job, const Event& event) {
  const Renderer by = renderer_of(worker, job);
  std::vector<PendingAudits::Key> keys = job.audits().next_for(by, 1);
  if (keys.empty()) {
    return false;
  }
  const SampleRange range = keys.front().range;
  const std::uint32_t tiles = choose_tile_count(range, job.audits().size() - job.audits().out(),
                                                job.pixels_of(keys.front().tile), aim_for(worker, job, event.now));
  if (tiles > 1) {
    keys = job.audits().next_for(by, tiles);
  }
  const LeaseId id = leases_.next_id();
  Unit unit{job.id(), range, {}};
  for (const PendingAudits::Key& key : keys) {
    unit.tiles.push_back(key.tile);
    job.audits().lease(key, id);
  }
  leases_.open(worker, job, {.id = id, .unit = std::move(unit), .audits = true}, event.now);
  leases_.send_grant(worker, job, id, event);
  queue_.refresh(job);
  return true;
}

}  // namespace lightmill
