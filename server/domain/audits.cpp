#include "server/domain/audits.h"

#include <fmt/ranges.h>

#include "common/base/check.h"
#include "common/base/number_text.h"
#include "server/domain/eligibility.h"

namespace lightmill {
namespace {

/// Number of claims, all different, after which no further identity is asked.
constexpr std::size_t kMaxClaims = 5;

}  // namespace

std::string describe_place(const Job& job, TileId tile, const SampleRange& range) {
  const PixelRect rect = job.outline().grid().tile_rect(tile);
  return fmt::format("samples [{}, {}) of the {}x{} pixels at {}, {} of job {}", range.first(), range.end(), rect.width,
                     rect.height, rect.x, rect.y, job.id().value);
}

std::string describe_renderers(std::span<const Claim> claims) {
  std::vector<std::string> names;
  for (const Claim& claim : claims) {
    names.push_back(describe_renderer(claim.by));
  }
  return fmt::format("{}", fmt::join(names, " and "));
}

void Audits::restore(Job& job, std::span<const Renderer> renderers,
                     std::span<const StoredState::StoredResult> results) {
  for (const StoredState::StoredResult& result : results) {
    const NodeOutline* const node = job.outline().find(result.tile, result.range);
    if (node == nullptr) {
      provenance_.add_orphan({job.id(), result.tile, result.range});  // its node was damaged and is rendered again
      continue;
    }
    const Renderer& by = renderers[result.by];
    identities_before_.insert(by.identity);
    provenance_.restore(job.id(), result.tile, node->range, by);
    if (result.audit_pending && (job.active() || job.state() == JobState::done)) {
      job.audits().open({result.range, result.tile}, {by, result.hash});
    }
  }
}

double Audits::parts_in(const Job& job, const NodeKey& key) {
  const std::uint64_t samples = std::min(job.plan().goal(), 2 * std::max(job.film().frame_samples(), key.range.end()));
  const double whole = static_cast<double>(samples) * static_cast<double>(job.film().grid().pixel_count());
  const double result = static_cast<double>(key.range.count()) * static_cast<double>(job.pixels_of(key.tile));
  return std::max(1.0, kPartsOfAJob * result / whole);
}

void Audits::merged(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, const MergeOutcome& outcome,
                    bool unusual, const Event& event) {
  provenance_.merged(key, by, outcome);
  for (const SampleRange& range : outcome.removed) {
    event.store(DropNode{{key.job, key.tile, range}});
  }
  for (const NodePtr& node : outcome.added) {
    event.store(PutNode{key.job, key.tile, node});
  }
  const bool replaced =
      std::ranges::any_of(outcome.removed, [&](const SampleRange& range) { return key.range.contains(range); });
  if (replaced) {
    event.store(DropResults{key});
    for (const auto& [audit_key, lease] : job.audits().close_within(key.tile, key.range)) {
      if (lease) {
        leases_.tile_done(*lease, key.tile, false, event);
      }
    }
  }
  const double share = job.spec().audit_share;
  const bool audited = share > 0 && !by.identity.empty() &&
                       (replaced || unusual || is_chosen(secret_, key, chance_of_audit(share, parts_in(job, key))));
  event.store(PutResult{key, hash, by, audited});
  if (audited) {
    job.audits().open({key.range, key.tile}, {by, hash});
  }
}

std::optional<Claim> Audits::claim_of_film(const Job& job, const NodeKey& key, const Renderer& by) const {
  const std::span<const std::uint32_t> parts = provenance_.parts(key);
  if (parts.empty() && job.spec().allow_mixed) {
    return std::nullopt;
  }
  if (std::ranges::any_of(parts, [&](std::uint32_t part) {
        return provenance_.renderer(part).fingerprint_class != by.fingerprint_class;
      })) {
    return std::nullopt;
  }
  const std::vector<NodePtr>& forest = job.film().forest(key.tile);
  const auto node = std::ranges::find_if(forest, [&](const NodePtr& each) { return each->range == key.range; });
  LM_CHECK(node != forest.end(), "{} is in no film", describe_place(job, key.tile, key.range));
  if (parts.size() == 1) {
    return Claim{provenance_.renderer(parts.front()), hash_of(**node)};
  }
  Claim joined{{"", "", by.fingerprint_class}, hash_of(**node)};
  for (const std::uint32_t part : parts) {
    joined.parts.push_back(provenance_.renderer(part).identity);
  }
  return joined;
}

Dispute Audits::compare(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, bool differs,
                        const Event& event) {
  const PendingAudits::Key audit_key{key.range, key.tile};
  const PendingAudits::Entry* const entry = job.audits().find(audit_key);
  if (entry == nullptr) {
    if (!differs || job.spec().audit_share <= 0) {
      return {};
    }
    // These samples were not selected, but a copy rendered them again. The film has the first claim.
    std::optional<Claim> first = claim_of_film(job, key, by);
    if (!first) {
      return {};
    }
    job.audits().open(audit_key, *std::move(first), false);
  } else if (!PendingAudits::may_claim(*entry, by)) {
    return {};  // an identity may claim once, and only in the class of the place
  }
  const Verdict verdict = job.audits().claim(audit_key, {by, hash});
  if (verdict.kind == Verdict::Kind::agreed) {
    return settle(job, key, verdict.hash, event);
  }
  const PendingAudits::Entry& open = *job.audits().find(audit_key);
  const std::vector<Claim>& claims = open.claims;
  if (verdict.kind == Verdict::Kind::program && !another_may_decide(job, open, event.now)) {
    return {.wrong = claims};
  }
  event.warn(about(job.id()), "{} differ between {}: another identity must render them",
             describe_place(job, key.tile, key.range), describe_renderers(claims));
  return {};
}

Dispute Audits::settle(Job& job, const NodeKey& key, const Hash128& hash, const Event& event) {
  const PendingAudits::Key audit_key{key.range, key.tile};
  const PendingAudits::Entry entry = *job.audits().find(audit_key);
  if (const std::optional<LeaseId> lease = job.audits().close(audit_key)) {
    leases_.tile_done(*lease, key.tile, false, event);
  }
  Dispute dispute;
  for (const Claim& claim : entry.claims) {
    (claim.hash == hash ? dispute.agreed : dispute.wrong).push_back(claim);
  }
  if (entry.chosen && entry.claims.front().hash == hash) {  // else the first claim may be a joined node
    job.result_audited();
    ++totals_.results_audited;
    event.store(PutAudited{key});
  }
  return dispute;
}

// ---- auditors ----

std::vector<Renderer> Audits::renderers_for(const Job& job, Time now) const {
  std::set<Renderer> all;
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.stays() && may_render(worker, job) && now < worker.last_message() + limits_.auditor_timeout) {
      all.insert({"", identity_of(worker.hello()), job.class_of_result(worker.hello().fingerprint_class)});
    }
  }
  for (const auto& [identity, was] : workers_.absent()) {
    if (now < was.since + limits_.auditor_timeout && suits(was.fingerprint_class, was.renderer_version, job) &&
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
  const Duration timeout = identities_before_.empty()       ? Duration::zero()
                           : identities_before_.size() == 1 ? limits_.restart_grace
                                                            : limits_.auditor_timeout;
  const bool others_may_come_back = now < started_ + timeout;
  return !others_may_come_back && !job.audits().possible_for(renderers_for(job, now));
}

bool Audits::another_may_decide(const Job& job, const PendingAudits::Entry& dispute, Time now) const {
  return dispute.claims.size() < kMaxClaims && std::ranges::any_of(renderers_for(job, now), [&](const Renderer& by) {
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
  return third
             ? ""
             : fmt::format(
                   "waits for a worker of another identity{}, which decides whose results are wrong: {} differ between {}",
                   of_class.empty() ? "" : " of class " + of_class,
                   describe_place(job, audit_key.tile, audit_key.range), describe_renderers(entry.claims));
}

std::string Audits::reason_for_audits(const Job& job) const {
  const PendingAudits& audits = job.audits();
  if (!audits.waiting() || audits.out() > 0) {
    return "";
  }
  std::vector<Renderer> connected;
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.session() && worker.stays() && may_render(worker, job)) {
      connected.push_back(renderer_of(worker, job));
    }
  }
  return audits.possible_for(connected)
             ? ""
             : fmt::format("waits up to {:.0f} s for a worker of another identity, which audits {}",
                           to_seconds(limits_.auditor_timeout), counted(audits.unaudited(), "result"));
}

}  // namespace lightmill
