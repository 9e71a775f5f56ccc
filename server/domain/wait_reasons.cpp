// Reasons for which jobs wait.
#include <fmt/ranges.h>

#include "server/domain/eligibility.h"
#include "server/domain/farm_view.h"

namespace lightmill {
namespace {

/// Workers ask again sooner than this.
constexpr Duration kMissingPatience = std::chrono::seconds(5);
/// A job without results for so long says which worker it waits for.
constexpr Duration kStandstill = std::chrono::minutes(1);

}  // namespace

void FarmView::asset_is_missing(const Sha256& digest, const Event& event) {
  std::erase_if(missing_assets_, [&](const auto& entry) { return event.now - entry.second > kMissingPatience; });
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

std::string FarmView::reason_to_wait(const Job& job, Time now) const {
  if (!job.in_progress()) {
    return "";
  }
  if (!scheduler_.held().empty()) {
    return scheduler_.held();
  }
  if (std::string missing = reason_of_missing(job, now); !missing.empty()) {
    return missing;
  }
  if (std::string dispute = audits_.reason_for_dispute(job); !dispute.empty()) {
    return dispute;
  }
  if (!job.leases().empty()) {
    return reason_of_standstill(job, now);
  }
  return !any_may_render(job) ? why_none_may(job) : job.refusals().empty() ? "" : job.refusals().reason_to_wait();
}

std::string FarmView::reason_of_missing(const Job& job, Time now) const {
  if (missing_assets_.empty()) {
    return "";
  }
  for (const Sha256& asset : *job.spec().settings.assets) {
    if (const auto missing = missing_assets_.find(asset);
        missing != missing_assets_.end() && now - missing->second < kMissingPatience) {
      return wait_for_lost(asset);
    }
  }
  return "";
}

std::string FarmView::wait_for_lost(const Sha256& asset) {
  return fmt::format("waits for a file that was lost ({}): submit the same scene again, which sends it",
                     asset.hex().substr(0, 12));
}

std::string FarmView::reason_of_standstill(const Job& job, Time now) const {
  const Lease* oldest = nullptr;
  for (const LeaseId id : job.leases()) {
    const Lease& lease = leases_.at(id);
    if (now < lease.got_on + kStandstill) {
      return "";
    }
    oldest = oldest == nullptr || lease.got_on < oldest->got_on ? &lease : oldest;
  }
  return fmt::format("waits for worker {}: no result for {:.0f} s", oldest->worker, to_seconds(now - oldest->got_on));
}

bool FarmView::any_may_render(const Job& job) const {
  return std::ranges::any_of(workers_.all(),
                             [&](const auto& entry) { return entry.second.stays() && may_render(entry.second, job); });
}

/// Why no connected worker may render the job. Reasons that an operator can change come first.
std::string FarmView::why_none_may(const Job& job) const {
  std::vector<std::string> in_quarantine, leaving, too_small, of_others;
  for (const auto& [name, worker] : workers_.all()) {
    if (!worker.session()) {
      continue;
    }
    const auto too_large = worker.too_large().find(job.id());
    const std::string& version = worker.hello().renderer_version;
    if (job.refusals().excludes(worker.identity())) {
      continue;
    }
    if (!suits(worker, job)) {
      of_others.push_back(version != job.spec().settings.renderer_version
                              ? fmt::format("{} has renderer {}", name, version)
                              : fmt::format("{} is of class {}", name, worker.hello().fingerprint_class));
    } else if (too_large != worker.too_large().end()) {
      too_small.push_back(fmt::format("for {} {}", name, too_large->second));
    } else {
      (worker.quarantined() ? in_quarantine : leaving).push_back(name);
    }
  }
  const auto some = [](const std::vector<std::string>& names) {
    return names.size() == 1 ? fmt::format("{} is", names[0])
                             : fmt::format("{} and {} more are", names[0], names.size() - 1);
  };
  std::vector<std::string> reasons;
  std::string remedy;
  if (!in_quarantine.empty()) {
    reasons.push_back(fmt::format("{} in quarantine", some(in_quarantine)));
    remedy = fmt::format(". End the quarantine with `lightmill workers release {}`", in_quarantine[0]);
  }
  if (!leaving.empty()) {
    reasons.push_back(fmt::format("{} leaving the farm", some(leaving)));
  }
  if (!reasons.empty()) {
    return fmt::format("waits for a worker: {}{}", fmt::join(reasons, "; "), remedy);
  }
  if (!job.refusals().empty()) {
    return job.refusals().reason_to_wait();
  }
  if (!too_small.empty()) {
    return fmt::format("waits for a larger worker; {}", too_small[0]);
  }
  if (of_others.empty()) {
    return "waits for a worker: none is connected";
  }
  const std::string fixed = job.spec().allow_mixed ? "" : job.record().fingerprint_class;
  return fmt::format("waits for a worker with renderer {}{}{}: {}", job.spec().settings.renderer_version,
                     fixed.empty() ? "" : " and fingerprint class ", fixed, of_others[0]);
}

}  // namespace lightmill
