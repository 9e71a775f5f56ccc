// Audits: results that another identity renders again, and the disputes that follow.
//
// Owns the secret that draws which results are audited, and which identities may come back after a start of the
// coordinator. Takes: merged results, and results of samples that the film has. Each job's open audits are in
// PendingAudits. What disputes mean for workers is in quarantine.h.
#pragma once

#include <set>

#include "server/domain/leases.h"
#include "server/domain/provenance.h"
#include "server/domain/quarantine_list.h"

namespace lightmill {

/// "samples [0, 64) of the 64x64 pixels at 128, 0 of job 3".
std::string describe_place(const Job& job, TileId tile, const SampleRange& range);
std::string describe_renderers(std::span<const Claim> claims);

/// Claims about samples that are wrong, because two identities have `agreed` on other bits. If `agreed` is empty, three
/// identities claim three different things, and the program is at fault.
struct Dispute {
  std::vector<Claim> agreed = {}, wrong = {};
};

class Audits {
 public:
  Audits(const CoordinatorLimits& limits, const Sha256& secret, Time started, const WorkerRegistry& workers,
         const QuarantineList& quarantine, LeaseTable& leases, Provenance& provenance, FarmTotals& totals)
      : limits_(limits),
        secret_(secret),
        started_(started),
        workers_(workers),
        quarantine_(quarantine),
        leases_(leases),
        provenance_(provenance),
        totals_(totals) {}

  /// Results that the film of a stored job was merged from.
  void restore(Job& job, std::span<const Renderer> renderers, std::span<const StoredState::StoredResult> results);
  void stood_still(Duration late) { started_ += late; }
  /// A result was merged; `outcome` says into which nodes. `unusual` ones are always audited.
  void merged(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, const MergeOutcome& outcome,
              bool unusual, const Event& event);
  /// A result of samples that the film has: an audit may wait for it. `differs`: from the film.
  Dispute compare(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, bool differs,
                  const Event& event);

  // ---- auditors.cpp ----
  /// Whether no worker that is here, or was lately, could audit more of the job.
  bool are_done(const Job& job, Time now) const;
  /// Whether all workers that are here and may render the job have one identity.
  bool one_identity(const Job& job) const;
  /// Whether a worker that is here, or was lately, may render the job.
  bool any_may_render(const Job& job, Time now) const;
  /// Empty, or about which samples two identities differ while no third one is here.
  std::string reason_for_dispute(const Job& job) const;

 private:
  /// The result's pixel samples, as so many of the parts that its job has; 1 at least. Of a job that grows, twice what
  /// it has now counts as the whole.
  static double parts_in(const Job& job, const NodeKey& key);
  /// What the film holds there, as a claim. Nothing if the job is mixed and workers of another class than `by`'s, or
  /// unknown ones, had a part in it.
  std::optional<Claim> claim_of_film(const Job& job, const NodeKey& key, const Renderer& by) const;
  /// Two identities have said `hash` of these samples.
  Dispute settle(Job& job, const NodeKey& key, const Hash128& hash, const Event& event);
  /// Identities and classes that may render the job, without names.
  std::vector<Renderer> renderers_for(const Job& job, Time now) const;

  const CoordinatorLimits& limits_;
  const Sha256 secret_;
  Time started_;
  std::set<std::string> identities_before_;  ///< of which an earlier coordinator had results
  const WorkerRegistry& workers_;
  const QuarantineList& quarantine_;
  LeaseTable& leases_;
  Provenance& provenance_;
  FarmTotals& totals_;
};

}  // namespace lightmill
