#include "server/access/connection_book.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

#include "common/base/check.h"
#include "server/access/call_limits.h"

namespace lightmill {
namespace {

/// Open files of a process that serves nobody.
constexpr std::size_t kOwnFiles = 64;
/// More handshakes of one address at a time would take longer than the patience with them.
constexpr std::size_t kMostStrangers = 1'024;

}  // namespace

DescriptorPlan plan_descriptors(std::uint64_t files) {
  const std::size_t all = std::min<std::uint64_t>(files, 1'000'000);
  const std::size_t rest = all > 2 * kOwnFiles ? all - kOwnFiles : kOwnFiles;
  DescriptorPlan plan{};
  plan.assets = std::min<std::size_t>(rest / 8, 8'192);
  plan.page = std::clamp<std::size_t>(rest / 8, 16, 1'024);
  plan.health = std::clamp<std::size_t>(rest / 16, 4, 64);
  plan.calls = std::max<std::size_t>(
      rest - std::min(rest, plan.assets + plan.page + plan.health + 3 * ConnectionBook::kSlack), 16);
  return plan;
}

std::string address_key(std::string_view peer) {
  std::string host(peer.substr(0, peer.rfind(':')));
  if (host.starts_with('[') && host.ends_with(']')) {
    host = host.substr(1, host.size() - 2);
    std::array<unsigned char, 16> bytes{};
    if (::inet_pton(AF_INET6, host.substr(0, host.find('%')).c_str(), bytes.data()) == 1) {
      return fmt::format("{:02x}::/64", fmt::join(bytes.begin(), bytes.begin() + 8, ""));
    }
  }
  return host;
}

std::size_t ConnectionBook::most_strangers() const {
  return std::clamp<std::size_t>(most_ / 4, 1, kMostStrangers);
}

std::size_t ConnectionBook::most_of(const Identity& caller) const {
  // All workers of a farm may have one certificate, and where nobody is asked, one address.
  const bool may_be_many = !caller.is_known() || caller.roles.has(Role::worker);
  return std::max<std::size_t>(may_be_many ? most_ / 4 * 3 : most_ / 8, 1);
}

bool ConnectionBook::is_full(const std::string& peer) const {
  const auto address = addresses_.find(address_key(peer));
  return address != addresses_.end() && address->second.served.size() >= most_strangers();
}

bool ConnectionBook::is_full(const std::string& peer, const Identity& caller) const {
  const auto found = callers_.find(caller_key(caller, peer));
  return found != callers_.end() && found->second >= most_of(caller);
}

template <class Change>
void ConnectionBook::change(const std::string& key, const Change& change) {
  Address& address = addresses_[key];
  by_size_.erase({address.size(), key});
  waiting_ -= address.waiting.size();
  change(address);
  waiting_ += address.waiting.size();
  if (address.size() > 0) {
    by_size_.emplace(address.size(), key);
  } else {
    addresses_.erase(key);
  }
}

ConnectionBook::Arrival ConnectionBook::arrive(const std::string& peer, Time now) {
  Arrival arrival;
  if (const auto earlier = peers_.find(peer); earlier != peers_.end()) {
    take_out(earlier->second);  // its end was not noticed
  }
  const std::string key = address_key(peer);
  if (is_full()) {
    const auto own = addresses_.find(key);
    const bool of_own = own != addresses_.end() && own->second.size() >= by_size_.rbegin()->first;
    if (by_size_.empty() || (of_own && own->second.waiting.empty())) {
      return arrival;
    }
    const Address& largest = of_own ? own->second : addresses_.at(by_size_.rbegin()->second);
    if (!largest.waiting.empty()) {
      arrival.close = *largest.waiting.begin();
      take_out(arrival.close);
    } else if (entries_.size() < most_ + kSlack) {
      arrival.end = *largest.served.begin();
      Entry& ended = entries_.at(arrival.end);
      change(ended.address, [&](Address& address) { address.served.erase(arrival.end); });
      ended.state = State::ending;
    } else {
      return arrival;
    }
  }
  arrival.id = next_id_++;
  arrival.fate = is_full(peer) ? Fate::wait : Fate::serve;
  entries_[arrival.id] = {peer, key, "", State::waiting, now};
  peers_[peer] = arrival.id;
  change(key, [&](Address& address) { address.waiting.insert(arrival.id); });
  if (arrival.fate == Fate::serve) {
    serve(arrival.id, now);
  }
  return arrival;
}

void ConnectionBook::serve(Id id, Time now) {
  Entry& entry = entries_.at(id);
  entry.state = State::served;
  entry.served_at = now;
  change(entry.address, [id](Address& address) {
    address.waiting.erase(id);
    address.served.insert(id);
  });
}

void ConnectionBook::leave(Id id) {
  if (entries_.contains(id)) {
    take_out(id);
  }
}

void ConnectionBook::take_out(Id id) {
  const auto found = entries_.find(id);
  const Entry entry = std::move(found->second);
  entries_.erase(found);
  if (const auto peer = peers_.find(entry.peer); peer != peers_.end() && peer->second == id) {
    peers_.erase(peer);
  }
  if (entry.state == State::waiting || entry.state == State::served) {
    change(entry.address, [id](Address& address) {
      address.waiting.erase(id);
      address.served.erase(id);
    });
  } else if (entry.state == State::known) {
    const auto caller = callers_.find(entry.caller);
    LM_CHECK(caller != callers_.end() && caller->second > 0);
    if (--caller->second == 0) {
      callers_.erase(caller);
    }
  }
}

Status ConnectionBook::meet(const std::string& peer, const Identity& caller) {
  const auto found = peers_.find(peer);
  if (found == peers_.end()) {
    return ok_status();
  }
  Entry& entry = entries_.at(found->second);
  if (entry.state != State::served) {
    return ok_status();
  }
  if (is_full(peer, caller)) {
    return resource_exhausted("this port takes {} connections of one caller: close some, or try again later",
                              most_of(caller));
  }
  change(entry.address, [id = found->second](Address& address) { address.served.erase(id); });
  entry.state = State::known;
  entry.caller = caller_key(caller, peer);
  ++callers_[entry.caller];
  return ok_status();
}

ConnectionBook::Changes ConnectionBook::look(Time now) {
  Changes changes;
  std::vector<std::string> keys;
  for (const auto& [key, address] : addresses_) {
    if (!address.waiting.empty()) {
      keys.push_back(key);
    }
  }
  for (const std::string& key : keys) {
    change(key, [&](Address& address) {
      while (!address.served.empty() && entries_.at(*address.served.begin()).served_at + kPatience <= now) {
        const Id id = *address.served.begin();
        address.served.erase(address.served.begin());
        entries_.at(id).state = State::ending;
        changes.end.push_back(id);
      }
    });
    while (addresses_.contains(key) && !addresses_.at(key).waiting.empty() &&
           addresses_.at(key).served.size() < most_strangers()) {
      const Id id = *addresses_.at(key).waiting.rbegin();
      serve(id, now);
      changes.serve.push_back(id);
    }
  }
  return changes;
}

}  // namespace lightmill
