// Slots that callers share. When all are taken, a stalled caller or the one with most slots gives one up.
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

/// The address of ADDRESS:PORT. The network of an IPv6 address (/64) counts as one address, because one machine can use
/// all of it. IPv6 addresses keep their brackets.
std::string address_key(std::string_view peer);

/// Owner of a slot. Slots with one name count together, and so do slots with one address.
struct Holder {
  std::string name;  ///< of the identity; without one, the address
  std::string address;
  friend auto operator<=>(const Holder&, const Holder&) = default;
};
/// `peer` is ADDRESS:PORT.
Holder holder_of(const Identity& identity, std::string_view peer);

/// Not thread-safe.
class SlotPool {
 public:
  using Id = std::uint64_t;

  /// `of_holder`: slots of one name at one address.
  SlotPool(std::size_t all, std::size_t of_holder) : all_(all), of_holder_(of_holder) {}

  enum class Answer { acquired, holder_limit, full };
  struct Arrival {
    Answer answer = Answer::acquired;
    std::optional<Id> evicted;  ///< a slot that is taken away: the caller has to end its call
  };
  /// Takes a slot. `id` identifies it until release().
  Arrival acquire(Id id, const Holder& holder, Time now);
  /// Does nothing if the slot is not held.
  void release(Id id);

  /// The call waits for its caller to send or read. set_active() ends this state.
  void set_stalled(Id id, Time now);
  void set_active(Id id);

  /// Takes the newest slot of the largest share away, to give `holder` one more. None if this would not make the shares
  /// more equal.
  std::optional<Id> evict_for(const Holder& holder);

  bool holds(Id id) const { return entries_.contains(id); }
  std::size_t size() const { return entries_.size(); }

  /// A stalled caller gives way after this time.
  static constexpr Duration kTimeout = std::chrono::seconds(10);

 private:
  struct Share {
    std::set<Id> ids;                       ///< by age
    std::set<std::pair<Time, Id>> stalled;  ///< by the time when they stalled
  };
  struct Entry {
    Holder holder;
    std::optional<Time> stalled_since;
  };
  std::optional<Id> longest_stalled(const Share& share, Time now) const;
  std::optional<Id> longest_stalled(Time now) const;

  const std::size_t all_, of_holder_;
  std::unordered_map<Id, Entry> entries_;
  std::map<Holder, Share> shares_;
  std::unordered_map<std::string, std::size_t> names_, addresses_;  ///< number of slots of each
};

}  // namespace lightmill
