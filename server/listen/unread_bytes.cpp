#include "server/listen/unread_bytes.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// The part of a caller's limit that a connection may have even if others of the caller have most.
constexpr std::uint64_t kShareOfOne = 256;

}  // namespace

std::vector<UnreadBytes::Id> UnreadBytes::over(std::span<const Received> known, Time now) {
  const double seconds = last_ == Time{} ? 0 : std::clamp(to_seconds(now - last_), 0.0, 60.0);
  last_ = now;
  const auto credit = static_cast<std::uint64_t>(std::lround(kCreditPerSecond * seconds));
  struct Unread {
    std::uint64_t bytes;
    const Received* connection;
  };
  std::vector<Unread> all;
  std::unordered_map<std::string, std::uint64_t> of_callers;
  std::unordered_map<Id, std::uint64_t> still_there;
  std::uint64_t sum = 0;
  for (const Received& each : known) {
    const auto found = taken_.find(each.id);
    // Bytes that were not sent give no credit.
    const std::uint64_t taken = std::min(credit + (found == taken_.end() ? 0 : found->second), each.bytes);
    still_there.emplace(each.id, taken);
    all.push_back({each.bytes - taken, &each});
    if (!each.alone) {
      of_callers[each.caller] += all.back().bytes;
      sum += all.back().bytes;
    }
  }
  taken_ = std::move(still_there);
  std::ranges::sort(all, std::greater(), &Unread::bytes);
  std::vector<Id> out;
  for (const auto& [bytes, connection] : all) {
    std::uint64_t& of_caller = of_callers[connection->caller];
    const bool counts = !connection->alone && bytes > limits_.of_caller / kShareOfOne;
    if (bytes > limits_.of_connection || (counts && (of_caller > limits_.of_caller || sum > limits_.of_all))) {
      out.push_back(connection->id);
      of_caller -= connection->alone ? 0 : bytes;
      sum -= connection->alone ? 0 : bytes;
    }
  }
  return out;
}

}  // namespace lightmill
