#include "server/domain/pending_audits.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {

bool is_chosen(const Sha256& secret, const NodeKey& key, double share) {
  if (!(share > 0)) {
    return false;
  }
  const std::array<std::uint64_t, 4> words{key.job.value, key.tile.value, key.range.level, key.range.index};
  Sha256Hasher hasher;
  hasher.append(std::as_bytes(std::span(secret.bytes)));
  hasher.append(std::as_bytes(std::span(words)));
  const Sha256 digest = hasher.finish();
  std::uint64_t draw = 0;
  for (int i = 0; i < 8; ++i) {
    draw = draw << 8 | digest.bytes[i];
  }
  return std::ldexp(static_cast<double>(draw >> 11), -53) < share;  // 53 bits are exact, and stay below 1
}

double chance_of_audit(double share, double parts) {
  return share >= 1 ? 1 : -std::expm1(parts * std::log1p(-share));
}

std::string describe_renderer(const Renderer& by) {
  return by.worker.empty() ? std::string("several workers together") : fmt::format("{} ({})", by.worker, by.identity);
}

namespace {

/// A joined node confirms none of the identities that rendered parts of it.
bool are_independent(const Claim& a, const Claim& b) {
  const auto may_confirm = [](const Claim& joined, const Claim& other) {
    return !joined.by.worker.empty() ||
           (!joined.parts.empty() && std::ranges::count(joined.parts, other.by.identity) == 0);
  };
  return a.by.identity != b.by.identity && may_confirm(a, b) && may_confirm(b, a);
}

}  // namespace

Verdict judge(std::span<const Claim> claims) {
  std::set<std::string_view> identities;  // if no claim is confirmed by another, all claims differ
  for (const Claim& one : claims) {
    if (!one.by.worker.empty()) {  // a joined node may have parts of an identity that has its own claim
      identities.insert(one.by.identity);
    }
    const bool seconded = std::ranges::any_of(
        claims, [&](const Claim& other) { return other.hash == one.hash && are_independent(one, other); });
    if (seconded) {
      return {Verdict::Kind::agreed, one.hash};
    }
  }
  return {identities.size() >= 3 ? Verdict::Kind::program : Verdict::Kind::open, {}};
}

std::vector<std::string> PendingAudits::losers(const Entry& entry) {
  std::vector<std::string> losers;
  for (const auto& [identity, times] : entry.lost) {
    if (times >= kMaxLost) {
      losers.push_back(identity);
    }
  }
  return losers;
}

bool PendingAudits::Group::is_for(const Renderer& by) const {
  return fingerprint_class == by.fingerprint_class && !excluded.contains(by.identity);
}

std::set<std::string> PendingAudits::claimants(const Entry& entry) {
  std::set<std::string> identities;
  for (const Claim& claim : entry.claims) {
    if (claim.parts.empty()) {
      identities.insert(claim.by.identity);
    }
    identities.insert(claim.parts.begin(), claim.parts.end());
  }
  return identities;
}

bool PendingAudits::is_disputed(const Entry& entry) {
  return entry.claims.size() > 1 && claimants(entry).size() > 1;
}

PendingAudits::Group PendingAudits::group_of(const Entry& entry) {
  Group group{entry.claims.front().by.fingerprint_class, claimants(entry)};
  for (std::string& loser : losers(entry)) {
    group.excluded.insert(std::move(loser));
  }
  return group;
}

void PendingAudits::list(const Key& key, const Entry& entry) {
  const std::size_t losers_of_it = losers(entry).size();
  lost_ += entry.chosen && losers_of_it > 0 ? 1 : 0;
  unaudited_ += entry.chosen ? 1 : 0;
  if (entry.lease) {
    ++out_;
  } else if (is_disputed(entry)) {
    disputed_.insert(key);
  } else if (losers_of_it < kMaxLosers) {
    waiting_[group_of(entry)].insert(key);
  }
}

void PendingAudits::unlist(const Key& key, const Entry& entry) {
  lost_ -= entry.chosen && !losers(entry).empty() ? 1 : 0;
  unaudited_ -= entry.chosen ? 1 : 0;
  if (entry.lease) {
    --out_;
    return;
  }
  disputed_.erase(key);
  if (const auto found = waiting_.find(group_of(entry)); found != waiting_.end()) {
    found->second.erase(key);
    if (found->second.empty()) {
      waiting_.erase(found);
    }
  }
}

void PendingAudits::open(const Key& key, Claim first, bool chosen) {
  const auto [at, fresh] = entries_.try_emplace(key);
  if (fresh) {
    ranges_[key.tile].insert(key.range);
  } else {
    unlist(key, at->second);
  }
  at->second = Entry{{std::move(first)}, {}, {}, chosen};
  list(key, at->second);
}

const PendingAudits::Entry* PendingAudits::find(const Key& key) const {
  const auto found = entries_.find(key);
  return found == entries_.end() ? nullptr : &found->second;
}

Verdict PendingAudits::claim(const Key& key, Claim claim) {
  Entry& entry = entries_.at(key);
  unlist(key, entry);
  entry.claims.push_back(std::move(claim));
  list(key, entry);
  return judge(entry.claims);
}

std::optional<LeaseId> PendingAudits::close(const Key& key) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) {
    return std::nullopt;
  }
  unlist(key, found->second);
  const std::optional<LeaseId> lease = found->second.lease;
  entries_.erase(found);
  const auto of_tile = ranges_.find(key.tile);
  of_tile->second.erase(key.range);
  if (of_tile->second.empty()) {
    ranges_.erase(of_tile);
  }
  return lease;
}

std::vector<std::pair<PendingAudits::Key, std::optional<LeaseId>>> PendingAudits::close_within(TileId tile,
                                                                                               SampleRange range) {
  std::vector<Key> within;
  if (const auto of_tile = ranges_.find(tile); of_tile != ranges_.end()) {
    for (const SampleRange& each : of_tile->second) {
      if (range.contains(each)) {
        within.push_back({each, tile});
      }
    }
  }
  std::vector<std::pair<Key, std::optional<LeaseId>>> closed;
  for (const Key& key : within) {
    closed.emplace_back(key, close(key));
  }
  return closed;
}

bool PendingAudits::may_claim(const Entry& entry, const Renderer& by) {
  return entry.claims.front().by.fingerprint_class == by.fingerprint_class &&
         std::ranges::none_of(entry.claims, [&](const Claim& claim) { return claim.by.identity == by.identity; });
}

bool PendingAudits::may_audit(const Entry& entry, const Renderer& by) {
  const auto lost = entry.lost.find(by.identity);
  return may_claim(entry, by) && (lost == entry.lost.end() || lost->second < kMaxLost);
}

std::vector<PendingAudits::Key> PendingAudits::next_for(const Renderer& by, std::size_t most) const {
  for (const Key& key : disputed_) {
    if (may_audit(entries_.at(key), by)) {
      return {key};
    }
  }
  for (const auto& [group, places] : waiting_) {
    if (!group.is_for(by)) {
      continue;
    }
    std::vector<Key> next;
    for (auto at = places.begin(); at != places.end() && next.size() < most && at->range == places.begin()->range;
         ++at) {
      next.push_back(*at);
    }
    return next;
  }
  return {};
}

void PendingAudits::lease(const Key& key, LeaseId lease) {
  Entry& entry = entries_.at(key);
  LM_CHECK(!entry.lease);
  unlist(key, entry);
  entry.lease = lease;
  list(key, entry);
}

bool PendingAudits::take_over(const Key& key, LeaseId from, LeaseId to, const Renderer& by) {
  const auto found = entries_.find(key);
  if (found == entries_.end() || found->second.lease != from || !may_audit(found->second, by)) {
    return false;
  }
  found->second.lease = to;
  return true;
}

void PendingAudits::release(const Key& key, LeaseId lease, const std::string* loser) {
  const auto found = entries_.find(key);
  if (found == entries_.end() || found->second.lease != lease) {
    return;
  }
  unlist(key, found->second);
  found->second.lease.reset();
  if (loser != nullptr) {
    ++found->second.lost[*loser];
  }
  list(key, found->second);
  if (is_settled(found->second)) {
    close(key);
  }
}

bool PendingAudits::possible_for(std::span<const Renderer> all) const {
  return std::ranges::any_of(all, [&](const Renderer& by) {
    return std::ranges::any_of(waiting_, [&](const auto& group) { return group.first.is_for(by); }) ||
           std::ranges::any_of(disputed_, [&](const Key& key) { return may_audit(entries_.at(key), by); });
  });
}

}  // namespace lightmill
