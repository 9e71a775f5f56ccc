#include "server/domain/refusals.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/domain/retry_delay.h"

namespace lightmill {
namespace {

/// Identities whose own limits are remembered. Workers of further ones get the job again at once.
constexpr std::size_t kMostIdentities = 1000;

}  // namespace

void Refusals::add(const std::string& identity, const std::string& worker, const std::string& reason, bool certain) {
  refusals_.push_back({identity, worker, reason, certain});
}

bool Refusals::excludes(const std::string& identity) const {
  return std::ranges::find(refusals_, identity, &Refusal::identity) != refusals_.end();
}

std::string Refusals::text() const {
  const Refusal &first = refusals_.front(), &last = refusals_.back();
  return refusals_.size() == 1 ? fmt::format("worker {}: {}", first.worker, first.reason)
         : first.reason == last.reason
             ? fmt::format("workers {} and {}: {}", first.worker, last.worker, first.reason)
             : fmt::format("worker {}: {}; worker {}: {}", first.worker, first.reason, last.worker, last.reason);
}

std::string Refusals::reason_to_wait() const {
  return fmt::format("waits for a worker of another identity: worker {} refused it: {}", refusals_.front().worker,
                     refusals_.front().reason);
}

void Refusals::left_to_others(const std::string& identity, Time now) {
  if (left_to_others_.size() < kMostIdentities || left_to_others_.contains(identity)) {
    LeftToOthers& row = left_to_others_[identity];
    ++row.times;
    row.last = now;
  }
}

Time Refusals::may_have_from(const std::string& identity, Time connected_at) const {
  const auto found = left_to_others_.find(identity);
  return found == left_to_others_.end() || connected_at < found->second.last
             ? Time::min()
             : found->second.last + retry_delay(found->second.times);
}

}  // namespace lightmill
