// Auditors: workers that may audit results of others.
#include "server/domain/audits.h"
#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

/// If so many claims all differ, no further identity is asked.
constexpr std::size_t kMostClaims = 5;

}  // namespace

std::vector<Renderer> Audits::renderers_for(const Job& job, Time now) const {
  std::set<Renderer> all;
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.stays() && may_render(worker, job) && now < worker.heard_at() + limits_.auditor_patience) {
      all.insert({"", identity_of(worker.hello()), job.class_of_result(worker.hello().fingerprint_class)});
    }
  }
  for (const auto& [identity, was] : workers_.absent()) {
    if (now < was.since + limits_.auditor_patience && suits(was.fingerprint_class, was.renderer_version, job) &&
        !quarantine_.contains({"", identity}) && !job.refusals().excludes(identity)) {
      all.insert({"", identity, job.class_of_result(was.fingerprint_class)});
    }
  }
  return {all.begin(), all.end()};
}

bool Audits::are_done(const Job& job, Time now) const {
  if (job.audits().out() > 0 || !job.audits().disputed().empty()) {
    return false;
  }
  if (!job.audits().waiting()) {
    return true;
  }
  // The farm does not know an identity without results before the start. It may come back too.
  const Duration patience = identities_before_.empty()       ? Duration::zero()
                            : identities_before_.size() == 1 ? limits_.restart_grace
                                                             : limits_.auditor_patience;
  const bool others_may_come_back = now < started_ + patience;
  return !others_may_come_back && !job.audits().possible_for(renderers_for(job, now));
}

bool Audits::another_may_decide(const Job& job, const PendingAudits::Entry& dispute, Time now) const {
  return dispute.claims.size() < kMostClaims && std::ranges::any_of(renderers_for(job, now), [&](const Renderer& by) {
           return PendingAudits::may_audit(dispute, by);
         });
}

bool Audits::one_identity(const Job& job) const {
  const std::string* first = nullptr;
  for (const auto& [name, worker] : workers_.all()) {
    if (!worker.stays() || !may_render(worker, job)) {
      continue;
    }
    const std::string& identity = identity_of(worker.hello());
    if (first != nullptr && *first != identity) {
      return false;
    }
    first = &identity;
  }
  return first != nullptr;
}

bool Audits::any_may_render(const Job& job, Time now) const {
  const bool others_may_come_back = job.restored() || identities_before_.size() > 1;
  return (others_may_come_back && now < started_ + limits_.restart_grace) || !renderers_for(job, now).empty();
}

std::string Audits::reason_for_dispute(const Job& job) const {
  if (job.audits().disputed().empty()) {
    return "";
  }
  const PendingAudits::Key& audit_key = *job.audits().disputed().begin();
  const PendingAudits::Entry& entry = *job.audits().find(audit_key);
  const bool third = std::ranges::any_of(workers_.all(), [&](const auto& each) {
    return each.second.stays() && may_render(each.second, job) &&
           PendingAudits::may_audit(entry, renderer_of(each.second, job));
  });
  const std::string& of_class = entry.claims.front().by.fingerprint_class;
  return third ? ""
               : fmt::format(
                     "waits for a worker of another identity{}: {} differ between {}, so that one of them is wrong",
                     of_class.empty() ? "" : " of class " + of_class,
                     describe_place(job, audit_key.tile, audit_key.range), describe_renderers(entry.claims));
}

}  // namespace lightmill
