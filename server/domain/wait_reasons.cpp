#include "server/domain/wait_reasons.h"

#include <fmt/ranges.h>

#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

/// Workers ask again sooner than this.
constexpr Duration kMissingTimeout = std::chrono::seconds(5);
/// After this time without results, a job's reason names the worker that it waits for.
constexpr Duration kStandstill = std::chrono::minutes(1);

/// Counts workers, and keeps the first by name, which a reason names.
struct SomeWorkers {
  const Worker* first = nullptr;
  std::size_t count = 0;

  void add(const Worker& worker) {
    ++count;
    first = first == nullptr || worker.name() < first->name() ? &worker : first;
  }
  std::string text() const {
    return count == 1 ? fmt::format("{} is", first->name())
                      : fmt::format("{} and {} more are", first->name(), count - 1);
  }
};

std::string wait_for_lost(const Sha256& asset) {
  return fmt::format("waits for a file that was lost ({}): submit the same scene again, which sends it",
                     asset.hex().substr(0, 12));
}

/// Whether it needs no more samples. The plan's goal stays where it is while audits are open.
bool has_its_samples(const Job& job) {
  return job.plan().closed() || job.outline().frame_samples() >= job.plan().goal();
}

/// Why no connected worker may render the job. Reasons that an operator can change come first.
Wait why_none_may(const Job& job, const WorkerKinds::ByKind& kinds) {
  SomeWorkers in_quarantine, leaving, too_small, of_others;
  for (const auto& [kind, workers] : kinds) {
    const bool suited = suits(kind.second, kind.first, job);
    for (const Worker* const worker : workers) {
      if (job.refusals().excludes(worker->identity())) {
        continue;
      }
      if (!suited) {
        of_others.add(*worker);
        break;  // one is named, the first
      }
      (worker->too_large().contains(job.id()) ? too_small
       : worker->quarantined()                ? in_quarantine
                                              : leaving)
          .add(*worker);
    }
  }
  std::vector<std::string> reasons;
  std::string remedy;
  if (in_quarantine.count > 0) {
    reasons.push_back(fmt::format("{} in quarantine", in_quarantine.text()));
    remedy = fmt::format(". End the quarantine with `lightmill workers release {}`", in_quarantine.first->name());
  }
  if (leaving.count > 0) {
    reasons.push_back(fmt::format("{} draining", leaving.text()));
  }
  if (!reasons.empty()) {
    return {in_quarantine.count > 0 ? WaitReason::quarantine : WaitReason::leaving,
            fmt::format("waits for a worker: {}{}", fmt::join(reasons, "; "), remedy)};
  }
  if (!job.refusals().empty()) {
    return {WaitReason::refused, job.refusals().reason_to_wait()};
  }
  if (too_small.count > 0) {
    return {WaitReason::larger_worker, fmt::format("waits for a larger worker: for {} {}", too_small.first->name(),
                                                   too_small.first->too_large().at(job.id()))};
  }
  if (of_others.count == 0) {
    return {WaitReason::no_worker, "waits for a worker: none is connected"};
  }
  const WorkerHello& other = of_others.first->hello();
  const std::string& version = job.spec().settings.renderer_version;
  const std::string fixed = job.spec().allow_mixed ? "" : job.record().fingerprint_class;
  return {WaitReason::other_kind,
          fmt::format("waits for a worker with renderer {}{}{}: {} {}", version,
                      fixed.empty() ? "" : " and fingerprint class ", fixed, other.name,
                      other.renderer_version != version ? "has renderer " + other.renderer_version
                                                        : "is of class " + other.fingerprint_class)};
}

}  // namespace

const WorkerKinds::ByKind& WorkerKinds::get() {
  if (!kinds_) {
    kinds_.emplace();
    for (const auto& [name, worker] : workers_.all()) {
      if (worker.session()) {
        (*kinds_)[{worker.hello().renderer_version, worker.hello().fingerprint_class}].push_back(&worker);
      }
    }
  }
  return *kinds_;
}

bool WorkerKinds::any_may_render(const Job& job) {
  return std::ranges::any_of(get(), [&](const auto& entry) {
    const auto& [kind, workers] = entry;
    return suits(kind.second, kind.first, job) && std::ranges::any_of(workers, [&](const Worker* worker) {
             return worker->stays() && may_render(*worker, job);
           });
  });
}

void WaitReasons::asset_is_missing(const Sha256& digest, const Event& event) {
  std::erase_if(missing_assets_, [&](const auto& entry) { return event.now - entry.second > kMissingTimeout; });
  if (const auto known = missing_assets_.find(digest); known != missing_assets_.end()) {
    known->second = event.now;
    return;
  }
  for (const auto& [id, job] : jobs_.all()) {
    if (job->in_progress() && std::ranges::count(*job->spec().settings.assets, digest) > 0) {
      missing_assets_[digest] = event.now;
      job->touch();
      event.warn(about(id), "job {} {}", id.value, wait_for_lost(digest));
    }
  }
}

Wait WaitReasons::of(const Job& job, Time now, WorkerKinds& kinds) const {
  if (!job.in_progress()) {
    return {};
  }
  if (!scheduler_.held().empty()) {
    return {WaitReason::storage, scheduler_.held()};
  }
  if (std::string missing = reason_of_missing(job, now); !missing.empty()) {
    return {WaitReason::missing_file, std::move(missing)};
  }
  if (std::string dispute = audits_.reason_for_dispute(job); !dispute.empty()) {
    return {WaitReason::dispute, std::move(dispute)};
  }
  if (!job.leases().empty()) {
    return {WaitReason::silent_worker, reason_of_standstill(job, now)};
  }
  if (has_its_samples(job)) {
    if (std::string audits = audits_.reason_for_audits(job); !audits.empty()) {
      return {WaitReason::audit, std::move(audits)};
    }
  }
  if (!kinds.any_may_render(job)) {
    return why_none_may(job, kinds.get());
  }
  return job.refusals().empty() ? Wait{} : Wait{WaitReason::refused, job.refusals().reason_to_wait()};
}

std::string WaitReasons::reason_of_missing(const Job& job, Time now) const {
  if (missing_assets_.empty()) {
    return "";
  }
  for (const Sha256& asset : *job.spec().settings.assets) {
    if (const auto missing = missing_assets_.find(asset);
        missing != missing_assets_.end() && now - missing->second < kMissingTimeout) {
      return wait_for_lost(asset);
    }
  }
  return "";
}

std::string WaitReasons::reason_of_standstill(const Job& job, Time now) const {
  const Lease* oldest = nullptr;
  for (const LeaseId id : job.leases()) {
    const Lease& lease = leases_.at(id);
    if (now < lease.last_progress + kStandstill) {
      return "";
    }
    oldest = oldest == nullptr || lease.last_progress < oldest->last_progress ? &lease : oldest;
  }
  return fmt::format("waits for worker {}: no result for {:.0f} s", oldest->worker,
                     to_seconds(now - oldest->last_progress));
}

}  // namespace lightmill
