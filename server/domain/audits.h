// Audits: results that a second identity renders again, and the disputes that follow.
//
// Owns the secret that selects results for audit, and the identities that may come back after a restart of the
// coordinator. Takes merged results, and results of samples that the film has. PendingAudits has the open audits of a
// job. quarantine.h acts on disputes.
#pragma once

#include <set>

#include "server/domain/lease_table.h"
#include "server/domain/provenance.h"
#include "server/domain/quarantine_list.h"

namespace lightmill {

/// "samples [0, 64) of the 64x64 pixels at 128, 0 of job 3".
std::string describe_place(const Job& job, TileId tile, const SampleRange& range);
std::string describe_renderers(std::span<const Claim> claims);

/// Claims about samples. The `wrong` ones differ from the bits that two identities `agreed` on. If `agreed` is empty,
/// at least three identities claim different results, no other may decide, and the program is at fault.
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

  /// Takes the recorded results of a stored job.
  void restore(Job& job, std::span<const Renderer> renderers, std::span<const StoredState::StoredResult> results);
  void note_stall(Duration late) { started_ += late; }
  /// A result was merged, into the nodes of `outcome`. `unusual` results are always audited.
  void merged(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, const MergeOutcome& outcome,
              bool unusual, const Event& event);
  /// A result of samples that the film has. An audit may wait for it. `differs`: its bits are not those of the film.
  Dispute compare(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by, bool differs,
                  const Event& event);

  // ---- auditors: workers that may audit results of others ----
  /// Whether no worker that is connected, or was recently, can audit more of the job.
  bool are_done(const Job& job, Time now) const;
  /// Whether all connected workers that may render the job have one identity.
  bool one_identity(const Job& job) const;
  /// Whether a worker that is connected, or was recently, may render the job.
  bool any_may_render(const Job& job, Time now) const;
  /// The samples on which two identities differ while no third one is connected. Empty if there are none.
  std::string reason_for_dispute(const Job& job) const;
  /// The results that no connected worker may audit. Empty if there are none, or an audit is under way.
  std::string reason_for_audits(const Job& job) const;

 private:
  /// Size of the result in parts of its job (kPartsOfAJob), at least 1. The job's size is its goal, or twice its
  /// present samples if that is less.
  static double parts_in(const Job& job, const NodeKey& key);
  /// Claim for the bits of the film there. Nothing if the job allows several classes and a worker of another class than
  /// `by`'s, or an unknown one, rendered a part.
  std::optional<Claim> claim_of_film(const Job& job, const NodeKey& key, const Renderer& by) const;
  /// Two identities agree on `hash` for these samples.
  Dispute settle(Job& job, const NodeKey& key, const Hash128& hash, const Event& event);
  /// Whether an identity that is connected, or was recently, may still claim, and two may then agree.
  bool another_may_decide(const Job& job, const PendingAudits::Entry& dispute, Time now) const;
  /// Identities and classes that may render the job. The worker names are empty.
  std::vector<Renderer> renderers_for(const Job& job, Time now) const;

  const CoordinatorLimits& limits_;
  const Sha256 secret_;
  Time started_;
  std::set<std::string> identities_before_;  ///< an earlier coordinator had results of them
  const WorkerRegistry& workers_;
  const QuarantineList& quarantine_;
  LeaseTable& leases_;
  Provenance& provenance_;
  FarmTotals& totals_;
};

}  // namespace lightmill
