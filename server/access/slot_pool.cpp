#include "server/access/slot_pool.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

namespace lightmill {
namespace {

void take_one(std::unordered_map<std::string, std::size_t>& counts, const std::string& key) {
  if (const auto found = counts.find(key); --found->second == 0) {
    counts.erase(found);
  }
}

std::int64_t count_of(const std::unordered_map<std::string, std::size_t>& counts, const std::string& key) {
  const auto found = counts.find(key);
  return found == counts.end() ? 0 : static_cast<std::int64_t>(found->second);
}

}  // namespace

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

Holder holder_of(const Identity& identity, std::string_view peer) {
  const std::string address = address_key(peer);
  switch (identity.proof) {
    case Proof::none:
      return {"unknown at " + address, address};
    case Proof::certificate:
      return {"certificate " + identity.name, address};
    case Proof::token:
      return {"token " + identity.name, address};
  }
  return {};
}

SlotPool::Arrival SlotPool::acquire(Id id, const Holder& holder, Time now) {
  Arrival arrival;
  const auto own = shares_.find(holder);
  if (own != shares_.end() && own->second.ids.size() >= of_holder_ && of_holder_ < all_) {
    arrival.evicted = longest_stalled(own->second, now);
    arrival.answer = arrival.evicted ? Answer::acquired : Answer::holder_limit;
  } else if (entries_.size() >= all_) {
    arrival.evicted = longest_stalled(now);
    if (!arrival.evicted) {
      arrival.evicted = evict_for(holder);
    }
    arrival.answer = arrival.evicted ? Answer::acquired : Answer::full;
  }
  if (arrival.answer != Answer::acquired) {
    return arrival;
  }
  if (arrival.evicted) {
    release(*arrival.evicted);
  }
  entries_.emplace(id, Entry{holder, std::nullopt});
  shares_[holder].ids.insert(id);
  ++names_[holder.name];
  ++addresses_[holder.address];
  return arrival;
}

void SlotPool::release(Id id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) {
    return;
  }
  set_active(id);
  const Holder& holder = found->second.holder;
  take_one(names_, holder.name);
  take_one(addresses_, holder.address);
  const auto share = shares_.find(holder);
  share->second.ids.erase(id);
  if (share->second.ids.empty()) {
    shares_.erase(share);
  }
  entries_.erase(found);
}

void SlotPool::set_stalled(Id id, Time now) {
  set_active(id);
  if (const auto found = entries_.find(id); found != entries_.end()) {
    found->second.stalled_since = now;
    shares_.at(found->second.holder).stalled.emplace(now, id);
  }
}

void SlotPool::set_active(Id id) {
  const auto found = entries_.find(id);
  if (found != entries_.end() && found->second.stalled_since) {
    shares_.at(found->second.holder).stalled.erase({*found->second.stalled_since, id});
    found->second.stalled_since.reset();
  }
}

/// Each slot that is taken away reduces the sum of the squares of all names' and addresses' counts. So callers cannot
/// take slots from each other endlessly.
std::optional<SlotPool::Id> SlotPool::evict_for(const Holder& holder) {
  const std::int64_t of_name = count_of(names_, holder.name), of_address = count_of(addresses_, holder.address);
  std::int64_t most = 0;
  const Share* largest = nullptr;
  for (const auto& [other, share] : shares_) {
    const std::int64_t by_name = other.name == holder.name ? 0 : count_of(names_, other.name) - of_name - 1;
    const std::int64_t by_address =
        other.address == holder.address ? 0 : count_of(addresses_, other.address) - of_address - 1;
    if (by_name + by_address > most) {
      most = by_name + by_address;
      largest = &share;
    }
  }
  if (largest == nullptr) {
    return std::nullopt;
  }
  const Id newest = *largest->ids.rbegin();
  release(newest);
  return newest;
}

std::optional<SlotPool::Id> SlotPool::longest_stalled(const Share& share, Time now) const {
  return !share.stalled.empty() && share.stalled.begin()->first + kTimeout <= now
             ? std::optional(share.stalled.begin()->second)
             : std::nullopt;
}

std::optional<SlotPool::Id> SlotPool::longest_stalled(Time now) const {
  const auto longest = std::ranges::min_element(shares_, {}, [](const auto& entry) {
    return entry.second.stalled.empty() ? Time::max() : entry.second.stalled.begin()->first;
  });
  return longest == shares_.end() ? std::nullopt : longest_stalled(longest->second, now);
}

}  // namespace lightmill
