#include "server/domain/refusals.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/domain/limits.h"

namespace lightmill {
namespace {

/// Identities whose own limits are remembered. Workers of further ones get the job again at once.
constexpr std::size_t kMaxIdentities = 1000;
/// The most renderers that are remembered. Among so many, some do not refuse.
constexpr std::size_t kMaxRenderers = 64;
/// Busy workers of others ask for work sooner than this.
constexpr Duration kSilenceDelay = std::chrono::seconds(30);

}  // namespace

void Refusals::add(const std::string& identity, const std::string& worker, const std::string& reason, Cause cause) {
  refusals_.push_back({identity, worker, reason, cause});
}

void Refusals::rendered_by(const std::string& identity) {
  refuted_ = refuted_ || (!empty() && !excludes(identity));
  silence_.erase(identity);
  if (renderers_.size() < kMaxRenderers) {
    renderers_.insert(identity);
  }
}

bool Refusals::are_denied() const {
  return std::ranges::all_of(refusals_, [](const Refusal& each) { return each.cause == Cause::claim; }) &&
         std::ranges::any_of(renderers_, [this](const std::string& identity) { return !excludes(identity); });
}

bool Refusals::excludes(const std::string& identity) const {
  return std::ranges::find(refusals_, identity, &Refusal::identity) != refusals_.end();
}

std::string Refusals::Refusal::text() const {
  return worker.empty() ? reason : fmt::format("worker {}: {}", worker, reason);
}

std::string Refusals::text() const {
  const Refusal &first = refusals_.front(), &last = refusals_.back();
  return refusals_.size() == 1         ? first.text()
         : first.reason == last.reason ? fmt::format("workers {} and {}: {}", first.worker, last.worker, first.reason)
                                       : fmt::format("{}; {}", first.text(), last.text());
}

std::string Refusals::reason_to_wait() const {
  const Refusal& first = refusals_.front();
  return first.worker.empty() ? fmt::format("waits for a worker of another identity: {}", first.reason)
                              : fmt::format("waits for a worker of another identity: worker {} refused it: {}",
                                            first.worker, first.reason);
}

void Refusals::count(std::map<std::string, LeftToOthers>& rows, const std::string& identity, Time now) {
  if (rows.size() < kMaxIdentities || rows.contains(identity)) {
    LeftToOthers& row = rows[identity];
    ++row.times;
    row.last = now;
  }
}

void Refusals::left_to_others(const std::string& identity, Time now) {
  count(left_to_others_, identity, now);
}

void Refusals::held_in_silence(const std::string& identity, Time now) {
  count(held_in_silence_, identity, now);
  silence_.erase(identity);
}

Duration Refusals::add_silence(const std::string& identity, Duration time) {
  return silence_.size() < kMaxIdentities || silence_.contains(identity) ? silence_[identity] += time : time;
}

Time Refusals::may_have_from(const std::string& identity, Time connected_at) const {
  Time from = Time::min();
  if (const auto found = left_to_others_.find(identity);
      found != left_to_others_.end() && connected_at >= found->second.last) {
    from = found->second.last + retry_delay(found->second.times);
  }
  if (const auto found = held_in_silence_.find(identity); found != held_in_silence_.end()) {
    from = std::max(from, found->second.last + kSilenceDelay);
  }
  return from;
}

}  // namespace lightmill
