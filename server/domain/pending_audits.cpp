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
  std::set<std::string_view> identities;  // all their claims differ, if none is seconded
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

PendingAudits::Source PendingAudits::source_of(const Entry& entry) {
  return {entry.claims.front().by.fingerprint_class, entry.claims.front().by.identity};
}

void PendingAudits::list(const Place& place, const Entry& entry) {
  if (entry.lease) {
    ++out_;
  } else if (entry.claims.size() > 1) {
    disputed_.insert(place);
  } else if (entry.lost < kMostLost) {
    waiting_[source_of(entry)].insert(place);
  }
}

void PendingAudits::unlist(const Place& place, const Entry& entry) {
  if (entry.lease) {
    --out_;
    return;
  }
  disputed_.erase(place);
  if (const auto found = waiting_.find(source_of(entry)); found != waiting_.end()) {
    found->second.erase(place);
    if (found->second.empty()) {
      waiting_.erase(found);
    }
  }
}

void PendingAudits::open(const Place& place, Claim first, bool chosen) {
  const auto [at, fresh] = entries_.try_emplace(place);
  if (!fresh) {
    unlist(place, at->second);
  }
  at->second = Entry{{std::move(first)}, {}, 0, chosen};
  list(place, at->second);
}

const PendingAudits::Entry* PendingAudits::find(const Place& place) const {
  const auto found = entries_.find(place);
  return found == entries_.end() ? nullptr : &found->second;
}

Verdict PendingAudits::claim(const Place& place, Claim claim) {
  Entry& entry = entries_.at(place);
  unlist(place, entry);
  entry.claims.push_back(std::move(claim));
  list(place, entry);
  return judge(entry.claims);
}

std::optional<LeaseId> PendingAudits::close(const Place& place) {
  const auto found = entries_.find(place);
  if (found == entries_.end()) {
    return std::nullopt;
  }
  unlist(place, found->second);
  const std::optional<LeaseId> lease = found->second.lease;
  entries_.erase(found);
  return lease;
}

std::vector<std::pair<PendingAudits::Place, std::optional<LeaseId>>> PendingAudits::close_within(TileId tile,
                                                                                                 SampleRange range) {
  std::vector<Place> within;
  for (const auto& [place, entry] : entries_) {
    if (place.tile == tile && range.contains(place.range)) {
      within.push_back(place);
    }
  }
  std::vector<std::pair<Place, std::optional<LeaseId>>> closed;
  for (const Place& place : within) {
    closed.emplace_back(place, close(place));
  }
  return closed;
}

bool PendingAudits::may_claim(const Entry& entry, const Renderer& by) {
  return entry.claims.front().by.fingerprint_class == by.fingerprint_class &&
         std::ranges::none_of(entry.claims, [&](const Claim& claim) { return claim.by.identity == by.identity; });
}

std::vector<PendingAudits::Place> PendingAudits::next_for(const Renderer& by, std::size_t most) const {
  for (const Place& place : disputed_) {
    if (may_claim(entries_.at(place), by)) {
      return {place};
    }
  }
  for (const auto& [source, places] : waiting_) {
    if (source.first != by.fingerprint_class || source.second == by.identity) {
      continue;
    }
    std::vector<Place> next;
    for (auto at = places.begin(); at != places.end() && next.size() < most && at->range == places.begin()->range;
         ++at) {
      next.push_back(*at);
    }
    return next;
  }
  return {};
}

void PendingAudits::lease(const Place& place, LeaseId lease) {
  Entry& entry = entries_.at(place);
  LM_CHECK(!entry.lease);
  unlist(place, entry);
  entry.lease = lease;
  list(place, entry);
}

bool PendingAudits::take_over(const Place& place, LeaseId from, LeaseId to, const Renderer& by) {
  const auto found = entries_.find(place);
  if (found == entries_.end() || found->second.lease != from || !may_claim(found->second, by)) {
    return false;
  }
  found->second.lease = to;
  return true;
}

void PendingAudits::release(const Place& place, LeaseId lease, bool lost) {
  const auto found = entries_.find(place);
  if (found == entries_.end() || found->second.lease != lease) {
    return;
  }
  unlist(place, found->second);
  found->second.lease.reset();
  found->second.lost += lost ? 1 : 0;
  list(place, found->second);
  if (is_settled(found->second)) {
    close(place);
  }
}

bool PendingAudits::possible_for(std::span<const Renderer> all) const {
  return std::ranges::any_of(all, [&](const Renderer& by) {
    return std::ranges::any_of(waiting_,
                               [&](const auto& entry) {
                                 const auto& [of_class, identity] = entry.first;
                                 return of_class == by.fingerprint_class && identity != by.identity;
                               }) ||
           std::ranges::any_of(disputed_, [&](const Place& place) { return may_claim(entries_.at(place), by); });
  });
}

}  // namespace lightmill
