// Admission of connections to one port: which are served, which wait, and which must end to make room.
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

/// Division of a process's open files among its ports. The rest is for databases, asset files and the ports themselves.
struct DescriptorPlan {
  std::size_t calls;   ///< gRPC connections
  std::size_t page;    ///< HTTP connections
  std::size_t health;  ///< connections to the health port
  std::size_t assets;  ///< transfers of assets and films
};

/// Plan for a process that may open `files` files.
DescriptorPlan plan_descriptors(std::uint64_t files);

/// Limits connections per address while their caller is unknown, and per identity afterwards. Unknown connections
/// beyond the limit wait. The newest one is served next, so an earlier flood does not delay it. If the port is full,
/// the address with the most unknown connections loses one. If all are known, the address with the most connections
/// loses one. Not thread-safe.
class ConnectionLimiter {
 public:
  using Id = std::uint64_t;

  explicit ConnectionLimiter(std::size_t most) : most_(most) {}

  enum class Decision { serve, wait, refuse };
  struct Arrival {
    Id id = 0;  ///< of the connection, unless it is refused
    Decision decision = Decision::refuse;
    Id close = 0;  ///< a waiting connection to close now; 0: none
    Id end = 0;    ///< a served connection to end; 0: none
  };
  /// A connection from ADDRESS:PORT was accepted.
  Arrival arrive(const std::string& peer, Time now);
  /// The connection was closed.
  void leave(Id id);
  /// Sets the identity of the connection from ADDRESS:PORT. The first call counts. RESOURCE_EXHAUSTED if the caller has
  /// too many connections; this one remains unknown.
  Status set_caller(const std::string& peer, const Identity& caller);
  /// Makes the caller of a connection unknown until the next set_caller(). The connection is the first of its address
  /// to make room for others.
  void clear_caller(const std::string& peer, Time now);

  /// Served connections whose caller is unknown.
  std::vector<Id> unknown() const;
  struct Known {
    Id id;
    std::string caller;  ///< its key
    bool may_be_many;    ///< many machines may share it: a worker's identity, or an address
  };
  /// Connections whose caller is known.
  std::vector<Known> known() const;
  /// The connection from ADDRESS:PORT; 0 if there is none.
  Id id_of(const std::string& peer) const;
  const std::string& peer_of(Id id) const { return entries_.at(id).peer; }
  /// The connection is being ended, and counts no longer for its address.
  void end(Id id) { set_state(id, State::ending); }

  struct Changes {
    std::vector<Id> serve;  ///< these waited until now
    std::vector<Id> end;    ///< unknown ones whose time is over, one for each that is served instead
  };
  Changes update(Time now);

  bool is_full() const { return entries_.size() >= most_; }
  /// Whether another connection from this address has to wait.
  bool is_full(const std::string& peer) const;
  bool is_full(const std::string& peer, const Identity& caller) const;
  bool has_waiting() const { return waiting_ > 0; }
  std::size_t size() const { return entries_.size(); }

  /// Unknown connections of one address that are served at a time.
  std::size_t most_unknown() const;
  std::size_t most_of(const Identity& caller) const;
  /// Time to become known while others of the address wait.
  static constexpr Duration kTimeout = std::chrono::seconds(5);
  /// Extra connections that are accepted while the ones closed to make room for them are still open.
  static constexpr std::size_t kSlack = 16;

 private:
  enum class State { waiting, served, ending, known };
  struct Address {
    std::set<Id> waiting;                  ///< unknown, by age
    std::set<std::pair<Time, Id>> served;  ///< unknown, by the time at which they make room
    std::set<Id> known;                    ///< by age
    std::size_t unknown() const { return waiting.size() + served.size(); }
  };
  struct Entry {
    std::string peer, address, caller;
    State state = State::waiting;
    Time until{};
    bool may_be_many = false;
  };

  /// Changes an address, and updates by_size_.
  template <class Change>
  void change(const std::string& address, const Change& change);
  bool make_room(const std::string& address, Arrival& arrival);
  bool end_for(Arrival& arrival, Id id);
  void set_state(Id id, State to, Time until = {});
  void take_out(Id id);

  const std::size_t most_;
  Id next_id_ = 1;
  std::size_t waiting_ = 0;
  std::unordered_map<Id, Entry> entries_;
  std::unordered_map<std::string, Id> peers_;
  std::map<std::string, Address> addresses_;
  std::set<std::pair<std::size_t, std::string>> by_size_;  ///< addresses with unknown connections, by their number
  std::unordered_map<std::string, std::size_t> callers_;   ///< connections of each caller
};

}  // namespace lightmill
