// Pending audits of one job: which results another identity is to render again, what was claimed of each, and
// what follows from the claims.
//
// Pure and not thread-safe. Knows neither sessions nor the film. A claim says which bits a tile's samples have.
// Identities decide, not workers: whoever lies can call itself two workers, but has one certificate.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/ids.h"
#include "common/farm/messages.h"
#include "server/domain/effects.h"

namespace lightmill {

/// Whether a result is to be audited. SHA-256 over a secret of the farm picks `share` of them, from 0 to 1: workers
/// cannot foresee it, and every coordinator of the farm picks the same.
bool is_chosen(const Sha256& secret, const NodeKey& key, double share);

/// A job's pixel samples are so many parts, each of which is drawn with the job's share: what is looked at does not
/// depend on how few and large results a worker sends.
inline constexpr double kPartsOfAJob = 1000;
/// Chance that a result of `parts` parts has one that is drawn: 1 - (1 - share)^parts.
double chance_of_audit(double share, double parts);

/// Statement of a renderer that some samples have these bits. The joined node of several workers has neither a worker
/// nor an identity. All claims of one place are by workers of one class.
struct Claim {
  Renderer by;
  Hash128 hash;
  std::vector<std::string> parts = {};  ///< of a joined node: the identities that had a part in it; empty: unknown
  friend bool operator==(const Claim&, const Claim&) = default;
};

/// What follows from claims about the same samples.
struct Verdict {
  enum class Kind {
    open,     ///< another identity has to say
    agreed,   ///< two identities say `hash`, independently; claims of other bits are wrong
    program,  ///< three machines say three different things, which nobody can be blamed for
  };
  Kind kind = Kind::open;
  Hash128 hash;
};
Verdict judge(std::span<const Claim> claims);

/// "worker-1 on a", or "several workers together" for a joined node.
std::string describe_renderer(const Renderer& by);

class PendingAudits {
 public:
  struct Place {
    SampleRange range;  ///< first, so that those which make a unit stand together
    TileId tile;
    friend auto operator<=>(const Place&, const Place&) = default;
  };
  struct Entry {
    std::vector<Claim> claims;     ///< the first is what the film holds; others differ from it
    std::optional<LeaseId> lease;  ///< that renders it again
    std::uint32_t lost = 0;        ///< such leases that were lost
    bool chosen = true;            ///< to be rendered again; else it is here only while claims differ
  };
  /// A place with which so many leases were lost is not leased again: it may be why.
  static constexpr std::uint32_t kMostLost = 5;

  /// The result that `first` claims is to be rendered again, or, if not `chosen`, is about to be disputed. Replaces
  /// what was known of the place.
  void open(const Place& place, Claim first, bool chosen = true);
  /// Null if nothing is to be audited there.
  const Entry* find(const Place& place) const;
  /// Adds a claim to an open place. Returns what follows; unless that is `open`, the caller closes the place.
  Verdict claim(const Place& place, Claim claim);
  /// The place needs nothing more. Returns its lease, if it had one.
  std::optional<LeaseId> close(const Place& place);
  /// Closes all places of the tile whose samples lie in `range`. Returns them with what their leases were.
  std::vector<std::pair<Place, std::optional<LeaseId>>> close_within(TileId tile, SampleRange range);
  /// Takes back the claims of these renderers, but not those of the film.
  template <class Predicate>
  void retract(const Predicate& by) {
    std::vector<Place> settled;
    for (auto& [place, entry] : entries_) {
      if (entry.claims.size() > 1) {
        unlist(place, entry);
        entry.claims.erase(std::remove_if(entry.claims.begin() + 1, entry.claims.end(),
                                          [&](const Claim& each) { return by(each.by); }),
                           entry.claims.end());
        list(place, entry);
        if (is_settled(entry)) {
          settled.push_back(place);
        }
      }
    }
    for (const Place& place : settled) {
      close(place);
    }
  }

  /// Whether results of this renderer can be compared, and its identity has made no claim yet.
  static bool may_claim(const Entry& entry, const Renderer& by);
  /// Places that this worker may be leased now, at most `most`, all with the range of the first.
  std::vector<Place> next_for(const Renderer& by, std::size_t most) const;
  void lease(const Place& place, LeaseId lease);
  /// `to`, of this worker, works on the place instead of `from`. False, and as before, if `from` does not work on it or
  /// the worker may not claim it.
  bool take_over(const Place& place, LeaseId from, LeaseId to, const Renderer& by);
  /// The lease does not work on the place any more. Nothing happens if it did not.
  void release(const Place& place, LeaseId lease, bool lost);

  std::size_t size() const { return entries_.size(); }
  std::size_t out() const { return out_; }
  bool waiting() const { return !waiting_.empty() || !disputed_.empty(); }  ///< some place could be leased
  /// Places where two claims differ and that are not leased.
  const std::set<Place>& disputed() const { return disputed_; }
  /// Whether a place waits that one of these could audit.
  bool possible_for(std::span<const Renderer> all) const;

 private:
  /// Nothing differs any more, and it was not chosen.
  static bool is_settled(const Entry& entry) { return !entry.chosen && entry.claims.size() == 1 && !entry.lease; }
  void list(const Place& place, const Entry& entry);
  void unlist(const Place& place, const Entry& entry);

  std::map<Place, Entry> entries_;
  using Source = std::pair<std::string, std::string>;  ///< class and identity
  static Source source_of(const Entry& entry);
  std::map<Source, std::set<Place>> waiting_;  ///< with one claim, by where it is from; not leased
  std::set<Place> disputed_;
  std::size_t out_ = 0;
};

}  // namespace lightmill
