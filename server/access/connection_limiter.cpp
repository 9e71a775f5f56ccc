#include "server/access/connection_limiter.h"

#include <algorithm>

#include "common/base/check.h"
#include "server/access/call_limits.h"
#include "server/access/slot_pool.h"

namespace lightmill {
namespace {

/// Open files of an idle process.
constexpr std::size_t kOwnFiles = 64;
/// More concurrent handshakes of one address would exceed kTimeout.
constexpr std::size_t kMaxUnknown = 1'024;

/// All workers of a farm may share one certificate, or one address if the farm does not authenticate callers.
bool may_be_many(const Identity& caller) {
  return !caller.is_known() || caller.roles.has(Role::worker);
}

}  // namespace

DescriptorPlan plan_descriptors(std::uint64_t files) {
  const std::size_t all = std::min<std::uint64_t>(files, 1'000'000);
  const std::size_t rest = all > 2 * kOwnFiles ? all - kOwnFiles : kOwnFiles;
  DescriptorPlan plan{};
  plan.assets = std::min<std::size_t>(rest / 8, 8'192);
  plan.page = std::clamp<std::size_t>(rest / 8, 16, 1'024);
  plan.health = std::clamp<std::size_t>(rest / 16, 4, 64);
  plan.calls = std::max<std::size_t>(
      rest - std::min(rest, plan.assets + plan.page + plan.health + 3 * ConnectionLimiter::kSlack), 16);
  return plan;
}

std::size_t ConnectionLimiter::most_unknown() const {
  return std::clamp<std::size_t>(most_ / 4, 1, kMaxUnknown);
}

std::size_t ConnectionLimiter::most_of(const Identity& caller) const {
  return std::max<std::size_t>(may_be_many(caller) ? most_ / 4 * 3 : most_ / 8, 1);
}

bool ConnectionLimiter::is_full(const std::string& peer) const {
  const auto address = addresses_.find(address_key(peer));
  return address != addresses_.end() && address->second.served.size() >= most_unknown();
}

bool ConnectionLimiter::is_full(const std::string& peer, const Identity& caller) const {
  const auto found = callers_.find(caller_key(caller, peer));
  return found != callers_.end() && found->second >= most_of(caller);
}

template <class Change>
void ConnectionLimiter::change(const std::string& key, const Change& change) {
  Address& address = addresses_[key];
  by_size_.erase({address.unknown(), key});
  waiting_ -= address.waiting.size();
  change(address);
  waiting_ += address.waiting.size();
  if (address.unknown() > 0) {
    by_size_.emplace(address.unknown(), key);
  } else if (address.known.empty()) {
    addresses_.erase(key);
  }
}

ConnectionLimiter::Arrival ConnectionLimiter::arrive(const std::string& peer, Time now) {
  Arrival arrival;
  if (const auto earlier = peers_.find(peer); earlier != peers_.end()) {
    take_out(earlier->second);  // its end was not reported
  }
  const std::string key = address_key(peer);
  if (is_full() && !make_room(key, arrival)) {
    return arrival;
  }
  arrival.id = next_id_++;
  arrival.decision = is_full(peer) ? Decision::wait : Decision::serve;
  entries_[arrival.id] = {peer, key, "", State::waiting, {}};
  peers_[peer] = arrival.id;
  change(key, [&](Address& address) { address.waiting.insert(arrival.id); });
  if (arrival.decision == Decision::serve) {
    set_state(arrival.id, State::served, now + kTimeout);
  }
  return arrival;
}

/// Makes room for one more connection of this address. False if there is none.
bool ConnectionLimiter::make_room(const std::string& key, Arrival& arrival) {
  const auto own = addresses_.find(key);
  if (by_size_.empty()) {
    const auto largest =
        std::ranges::max_element(addresses_, {}, [](const auto& address) { return address.second.known.size(); });
    const std::size_t of_own = own == addresses_.end() ? 0 : own->second.known.size();
    return largest != addresses_.end() && largest->second.known.size() > of_own + 1 &&
           end_for(arrival, *largest->second.known.rbegin());
  }
  const bool is_largest = own != addresses_.end() && own->second.unknown() >= by_size_.rbegin()->first;
  const Address& largest = is_largest ? own->second : addresses_.at(by_size_.rbegin()->second);
  if (!largest.waiting.empty()) {
    arrival.close = *largest.waiting.begin();
    take_out(arrival.close);
    return true;
  }
  return !is_largest && end_for(arrival, largest.served.begin()->second);
}

bool ConnectionLimiter::end_for(Arrival& arrival, Id id) {
  if (entries_.size() >= most_ + kSlack) {
    return false;
  }
  arrival.end = id;
  set_state(id, State::ending);
  return true;
}

void ConnectionLimiter::leave(Id id) {
  if (entries_.contains(id)) {
    take_out(id);
  }
}

void ConnectionLimiter::take_out(Id id) {
  const auto found = entries_.find(id);
  set_state(id, State::ending);
  if (const auto peer = peers_.find(found->second.peer); peer != peers_.end() && peer->second == id) {
    peers_.erase(peer);
  }
  entries_.erase(found);
}

/// Changes the state of a connection, and the counters. `until`: end of the time of a served unknown connection.
void ConnectionLimiter::set_state(Id id, State to, Time until) {
  Entry& entry = entries_.at(id);
  change(entry.address, [&](Address& address) {
    address.waiting.erase(id);
    address.served.erase({entry.until, id});
    address.known.erase(id);
    if (to == State::served) {
      address.served.emplace(until, id);
    } else if (to == State::known) {
      address.known.insert(id);
    }
  });
  if (entry.state == State::known) {
    const auto caller = callers_.find(entry.caller);
    LM_CHECK(caller != callers_.end() && caller->second > 0);
    if (--caller->second == 0) {
      callers_.erase(caller);
    }
  }
  entry.state = to;
  entry.until = until;
}

Status ConnectionLimiter::set_caller(const std::string& peer, const Identity& caller) {
  const auto found = peers_.find(peer);
  if (found == peers_.end()) {
    return ok_status();
  }
  Entry& entry = entries_.at(found->second);
  if (entry.state != State::served) {
    return ok_status();
  }
  if (is_full(peer, caller)) {
    return resource_exhausted("this port accepts {} connections from one caller: close some, or try again later",
                              most_of(caller));
  }
  set_state(found->second, State::known);
  entry.caller = caller_key(caller, peer);
  entry.may_be_many = may_be_many(caller);
  ++callers_[entry.caller];
  return ok_status();
}

void ConnectionLimiter::clear_caller(const std::string& peer, Time now) {
  const auto found = peers_.find(peer);
  if (found != peers_.end() && entries_.at(found->second).state == State::known) {
    set_state(found->second, State::served, now);
  }
}

std::vector<ConnectionLimiter::Id> ConnectionLimiter::unknown() const {
  std::vector<Id> ids;
  for (const auto& [size, name] : by_size_) {
    for (const auto& [until, id] : addresses_.at(name).served) {
      ids.push_back(id);
    }
  }
  return ids;
}

std::vector<ConnectionLimiter::Known> ConnectionLimiter::known() const {
  std::vector<Known> all;
  for (const auto& [key, address] : addresses_) {
    for (const Id id : address.known) {
      const Entry& entry = entries_.at(id);
      all.push_back({id, entry.caller, entry.may_be_many});
    }
  }
  return all;
}

ConnectionLimiter::Id ConnectionLimiter::id_of(const std::string& peer) const {
  const auto found = peers_.find(peer);
  return found == peers_.end() ? 0 : found->second;
}

ConnectionLimiter::Changes ConnectionLimiter::update(Time now) {
  Changes changes;
  std::vector<std::string> keys;
  for (const auto& [key, address] : addresses_) {
    if (!address.waiting.empty()) {
      keys.push_back(key);
    }
  }
  for (const std::string& key : keys) {
    const Address& address = addresses_.at(key);
    while (!address.waiting.empty()) {
      if (address.served.size() >= most_unknown()) {
        const auto [until, longest] = *address.served.begin();
        if (until > now) {
          break;
        }
        changes.end.push_back(longest);
        set_state(longest, State::ending);
      }
      changes.serve.push_back(*address.waiting.rbegin());
      set_state(changes.serve.back(), State::served, now + kTimeout);
    }
  }
  return changes;
}

}  // namespace lightmill
