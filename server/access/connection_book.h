// The connections of one port: which are served at once, which wait, and which end so that others get in.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/base/clock.h"
#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

/// How a process divides its open files among its ports. What is left is for databases, assets and the ports
/// themselves.
struct DescriptorPlan {
  std::size_t calls;   ///< connections of gRPC
  std::size_t page;    ///< connections over HTTP
  std::size_t health;  ///< connections to the port of health checks
  std::size_t assets;  ///< assets and films under way
};

/// Of a process that may have so many open files.
DescriptorPlan plan_descriptors(std::uint64_t files);

/// Limits strangers per address, and known callers per identity. A stranger is a connection whose caller is not known
/// yet. Strangers beyond the limit wait. The newest is served next, so that an earlier flood does not delay it. If all
/// places are taken, the address with most strangers makes room; without strangers, the one with most known callers.
/// Not thread-safe.
class ConnectionBook {
 public:
  using Id = std::uint64_t;

  explicit ConnectionBook(std::size_t most) : most_(most) {}

  enum class Fate { serve, wait, refuse };
  struct Arrival {
    Id id = 0;  ///< of the connection, unless it is refused
    Fate fate = Fate::refuse;
    Id close = 0;  ///< a connection that waits and is to be closed now; 0: none
    Id end = 0;    ///< one that is served and is to be ended; 0: none
  };
  /// A connection that was accepted from ADDRESS:PORT.
  Arrival arrive(const std::string& peer, Time now);
  /// It is closed.
  void leave(Id id);
  /// The caller that a connection from ADDRESS:PORT has shown to be. The first one counts. RESOURCE_EXHAUSTED if it has
  /// too many; the connection is a stranger's then.
  Status meet(const std::string& peer, const Identity& caller);
  /// A connection whose caller was met is a stranger's again until the next meeting, and makes room for others of its
  /// address at once.
  void part(const std::string& peer, Time now);

  struct Changes {
    std::vector<Id> serve;  ///< they waited until now
    std::vector<Id> end;    ///< strangers that have had their time, one for each that is served
  };
  Changes look(Time now);

  bool is_full() const { return entries_.size() >= most_; }
  /// Whether another stranger from there would wait.
  bool is_full(const std::string& peer) const;
  bool is_full(const std::string& peer, const Identity& caller) const;
  bool somebody_waits() const { return waiting_ > 0; }
  std::size_t size() const { return entries_.size(); }

  /// Strangers of one address that are served at a time.
  std::size_t most_strangers() const;
  std::size_t most_of(const Identity& caller) const;
  /// A stranger has so long while others of its address wait.
  static constexpr Duration kPatience = std::chrono::seconds(5);
  /// Newcomers that are taken while those that are ended for them are not yet gone.
  static constexpr std::size_t kSlack = 16;

 private:
  enum class State { waiting, served, ending, known };
  struct Address {
    std::set<Id> waiting;                  ///< strangers, by age
    std::set<std::pair<Time, Id>> served;  ///< strangers, by when they make room for others of their address
    std::set<Id> known;                    ///< by age
    std::size_t strangers() const { return waiting.size() + served.size(); }
  };
  struct Entry {
    std::string peer, address, caller;
    State state = State::waiting;
    Time until{};
  };

  /// Changes an address and keeps by_size_ in order.
  template <class Change>
  void change(const std::string& address, const Change& change);
  bool make_room(const std::string& address, Arrival& arrival);
  bool end_for(Arrival& arrival, Id id);
  void turn(Id id, State to, Time until = {});
  void take_out(Id id);

  const std::size_t most_;
  Id next_id_ = 1;
  std::size_t waiting_ = 0;
  std::unordered_map<Id, Entry> entries_;
  std::unordered_map<std::string, Id> peers_;
  std::map<std::string, Address> addresses_;
  std::set<std::pair<std::size_t, std::string>> by_size_;  ///< by strangers: of those that have some
  std::unordered_map<std::string, std::size_t> callers_;   ///< connections of each
};

}  // namespace lightmill
