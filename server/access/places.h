// Places that callers share: when all are taken, whoever stands still or has most gives one up.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "common/base/clock.h"
#include "server/access/identity.h"

namespace lightmill {

/// ADDRESS:PORT without the port. The network of an IPv6 address (/64) counts as one address, as one machine has all of
/// that. There are brackets around IPv6 addresses.
std::string address_key(std::string_view peer);

/// Whose a place is. Callers of one name count together, and so do callers at one address.
struct Holder {
  std::string name;  ///< of the identity; without one, of the address
  std::string address;
  friend auto operator<=>(const Holder&, const Holder&) = default;
};
/// `peer` is ADDRESS:PORT.
Holder holder_of(const Identity& identity, std::string_view peer);

/// Not thread-safe.
class Places {
 public:
  using Id = std::uint64_t;

  /// `of_holder`: of one name at one address.
  Places(std::size_t all, std::size_t of_holder) : all_(all), of_holder_(of_holder) {}

  enum class Answer { taken, holder_has_its_share, all_are_taken };
  struct Arrival {
    Answer answer = Answer::taken;
    std::optional<Id> gives_way;  ///< a place that is no longer held: its call is to be ended
  };
  /// Takes a place, which is known by `id` until it is left.
  Arrival arrive(Id id, const Holder& holder, Time now);
  /// Nothing happens if it is not held.
  void leave(Id id);

  /// The call stands still: its caller has to send or to read something. Again: it does so from now on.
  void stands_still(Id id, Time now);
  void moves(Id id);

  /// The place that makes room for one more of the holder, which is held no longer: the newest of those who have most.
  /// None if that would not make the shares more equal.
  std::optional<Id> give_way_to(const Holder& holder);

  bool holds(Id id) const { return entries_.contains(id); }
  std::size_t size() const { return entries_.size(); }

  /// Who stands still for so long gives way.
  static constexpr Duration kPatience = std::chrono::seconds(10);

 private:
  struct Share {
    std::set<Id> ids;                        ///< by age
    std::set<std::pair<Time, Id>> standing;  ///< by how long they stand still
  };
  struct Entry {
    Holder holder;
    std::optional<Time> standing_since;
  };
  std::optional<Id> longest_standing(const Share& share, Time now) const;
  std::optional<Id> longest_standing(Time now) const;

  const std::size_t all_, of_holder_;
  std::unordered_map<Id, Entry> entries_;
  std::map<Holder, Share> shares_;
  std::unordered_map<std::string, std::size_t> names_, addresses_;  ///< places of each
};

}  // namespace lightmill
