// Pending audits of one job: the results that a second identity renders again, the claims about each, and the verdicts.
//
// Pure, and not thread-safe. Knows neither sessions nor the film. A claim says which bits a tile's samples have.
// Identities count, not workers: a dishonest user can start two workers with one certificate.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/ids.h"
#include "common/farm/messages.h"
#include "server/domain/stored_rows.h"

namespace lightmill {

/// Whether a result is selected for audit. SHA-256 with a secret of the farm selects a share of `share` (0 to 1).
/// Workers cannot predict it, and every coordinator of the farm selects the same results.
bool is_chosen(const Sha256& secret, const NodeKey& key, double share);

/// Parts of a job's pixel samples. Each part is drawn with the job's share, so a worker cannot avoid audits by sending
/// few large results.
inline constexpr double kPartsOfAJob = 1000;
/// Probability that a result of `parts` parts is audited: 1 - (1 - share)^parts.
double chance_of_audit(double share, double parts);

/// Claim of a renderer that some samples have these bits. A joined node of several workers has neither worker nor
/// identity. All claims about one place are from workers of one class.
struct Claim {
  Renderer by;
  Hash128 hash;
  std::vector<std::string> parts = {};  ///< for a joined node, the identities that rendered parts of it; empty: unknown
  friend bool operator==(const Claim&, const Claim&) = default;
};

/// Verdict on claims about the same samples.
struct Verdict {
  enum class Kind {
    open,     ///< another identity must render them
    agreed,   ///< two independent identities claim `hash`; other claims are wrong
    program,  ///< three identities claim three different results; no worker can be blamed, unless others decide
  };
  Kind kind = Kind::open;
  Hash128 hash;
};
Verdict judge(std::span<const Claim> claims);

/// "worker-1 on a", or "several workers together" for a joined node.
std::string describe_renderer(const Renderer& by);

class PendingAudits {
 public:
  struct Key {
    SampleRange range;  ///< first, so that places of one unit are neighbours
    TileId tile;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  struct Entry {
    std::vector<Claim> claims;                       ///< the first is what the film holds; others differ from it
    std::optional<LeaseId> lease;                    ///< the audit's lease
    std::map<std::string, std::uint32_t> lost = {};  ///< how many of its audit leases each identity lost
    bool chosen = true;                              ///< selected for audit; else it is here only while claims differ
  };
  /// An identity that lost this number of leases of a place no longer gets it. Other identities do.
  static constexpr std::uint32_t kMaxLost = 5;
  /// A place that this number of identities lost kMaxLost times is not leased again, because it may be the cause.
  static constexpr std::size_t kMaxLosers = 3;

  /// Opens an audit of the result that `first` claims. Not `chosen`: the caller then adds a second claim, which
  /// differs. Replaces an earlier entry of the place.
  void open(const Key& key, Claim first, bool chosen = true);
  /// Null if no audit is open there.
  const Entry* find(const Key& key) const;
  /// Adds a claim to an open place. Unless the verdict is `open`, the caller closes the place.
  Verdict claim(const Key& key, Claim claim);
  /// Closes the place. Returns its lease, if it had one.
  std::optional<LeaseId> close(const Key& key);
  /// Closes all places of the tile whose samples lie in `range`. Returns them with their leases.
  std::vector<std::pair<Key, std::optional<LeaseId>>> close_within(TileId tile, SampleRange range);
  /// Removes the claims of these renderers, except claims of the film.
  template <class Predicate>
  void retract(const Predicate& by) {
    std::vector<Key> settled;
    for (auto& [key, entry] : entries_) {
      if (entry.claims.size() > 1) {
        unlist(key, entry);
        entry.claims.erase(std::remove_if(entry.claims.begin() + 1, entry.claims.end(),
                                          [&](const Claim& each) { return by(each.by); }),
                           entry.claims.end());
        list(key, entry);
        if (is_settled(entry)) {
          settled.push_back(key);
        }
      }
    }
    for (const Key& key : settled) {
      close(key);
    }
  }

  /// Whether this renderer has the class of the place, and its identity has made no claim yet.
  static bool may_claim(const Entry& entry, const Renderer& by);
  /// Whether this worker may also get the place: its identity has not lost it too often.
  static bool may_audit(const Entry& entry, const Renderer& by);
  /// Places that this worker may get now, at most `most`, all with the same range.
  std::vector<Key> next_for(const Renderer& by, std::size_t most) const;
  void lease(const Key& key, LeaseId lease);
  /// Moves the place from lease `from` to lease `to` of this worker. False, and no change, if `from` does not have it
  /// or the worker may not claim it.
  bool take_over(const Key& key, LeaseId from, LeaseId to, const Renderer& by);
  /// The lease no longer has the place. Does nothing if it did not have it. `loser`: the identity that lost it; null if
  /// it was not lost.
  void release(const Key& key, LeaseId lease, const std::string* loser);

  std::size_t size() const { return entries_.size(); }
  std::size_t unaudited() const { return unaudited_; }  ///< places selected for audit
  /// Places selected for audit that some identity no longer gets, because it lost them too often.
  std::size_t lost() const { return lost_; }
  std::size_t out() const { return out_; }
  bool waiting() const { return !waiting_.empty() || !disputed_.empty(); }  ///< a place can be leased
  /// Places where claims of several identities differ and that are not leased. One identity that contradicts itself
  /// makes no dispute: its job waits for no third identity.
  const std::set<Key>& disputed() const { return disputed_; }
  /// Whether one of these renderers may audit a place that waits.
  bool possible_for(std::span<const Renderer> all) const;

 private:
  /// Only one claim is left, and it was not selected for audit.
  static bool is_settled(const Entry& entry) { return !entry.chosen && entry.claims.size() == 1 && !entry.lease; }
  /// Call unlist() before each change of an entry, and list() after it, unless the change only replaces its lease.
  void unlist(const Key& key, const Entry& entry);
  void list(const Key& key, const Entry& entry);
  /// Identities that made a claim, or rendered parts of a joined node that has a claim.
  static std::set<std::string> claimants(const Entry& entry);
  static bool is_disputed(const Entry& entry);
  /// Identities that lost the place too often.
  static std::vector<std::string> losers(const Entry& entry);

  std::map<Key, Entry> entries_;
  std::map<TileId, std::set<SampleRange>> ranges_;  ///< of the entries of each tile
  struct Group {
    std::string fingerprint_class;
    std::set<std::string> excluded;  ///< identities that may not audit these places
    bool is_for(const Renderer& by) const;
    friend auto operator<=>(const Group&, const Group&) = default;
  };
  static Group group_of(const Entry& entry);
  std::map<Group, std::set<Key>> waiting_;  ///< places with claims of one identity; not leased
  std::set<Key> disputed_;
  std::size_t out_ = 0, lost_ = 0, unaudited_ = 0;
};

}  // namespace lightmill
