#include "server/access/refusal_log.h"

#include <utility>

#include "common/base/text.h"
#include "server/access/call_limits.h"

namespace lightmill {
namespace {

/// Strings may come from unknown callers and have any length, so they are shortened.
std::string key_of(const Call& call, const CallSubject& about, const Status& status) {
  return fmt::format("{}|{}|{}|{}|{}|{}", caller_key(call.caller, call.peer), call.caller.token, call.rpc.method,
                     about.job, as_name(about.text), as_name(message_of(status)));
}

}  // namespace

std::optional<SuppressedRefusals> RefusalLog::take(const Identity& caller, Time now) {
  Side& side = side_of(caller);
  if (!side.bucket.take(now)) {
    ++side.left_out;
    return std::nullopt;
  }
  return SuppressedRefusals{0, std::exchange(side.left_out, 0)};
}

std::optional<SuppressedRefusals> RefusalLog::take(const Call& call, const CallSubject& about, const Status& status,
                                                   Time now) {
  std::unordered_map<std::string, Seen>& seen = side_of(call.caller).seen;
  const std::string key = key_of(call, about, status);
  const auto found = seen.find(key);
  if (found != seen.end() && now - found->second.written_at < kSameRefusal) {
    ++found->second.repeated;
    return std::nullopt;
  }
  std::optional<SuppressedRefusals> suppressed = take(call.caller, now);
  if (!suppressed) {
    return std::nullopt;
  }
  if (found != seen.end()) {
    suppressed->repeated = found->second.repeated;
    found->second = {now, 0};
    return suppressed;
  }
  if (seen.size() >= kMaxRemembered) {
    std::erase_if(seen, [now](const auto& entry) { return now - entry.second.written_at >= kSameRefusal; });
  }
  if (seen.size() < kMaxRemembered) {
    seen.emplace(key, Seen{now, 0});
  }
  return suppressed;
}

}  // namespace lightmill
