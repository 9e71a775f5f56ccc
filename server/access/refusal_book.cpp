#include "server/access/refusal_book.h"

#include <utility>

#include "common/base/text.h"
#include "server/access/call_limits.h"

namespace lightmill {
namespace {

/// Strings may come from strangers and have any length, so they are shortened.
std::string key_of(const Call& call, const About& about, const Status& status) {
  return fmt::format("{}|{}|{}|{}|{}|{}", caller_key(call.caller, call.peer), call.caller.token,
                     static_cast<int>(call.rpc), about.job, as_name(about.text), as_name(message_of(status)));
}

}  // namespace

std::optional<Unwritten> RefusalBook::take(const Identity& caller, Time now) {
  Side& side = side_of(caller);
  if (!side.allowance.take(now)) {
    ++side.left_out;
    return std::nullopt;
  }
  return Unwritten{0, std::exchange(side.left_out, 0)};
}

std::optional<Unwritten> RefusalBook::take(const Call& call, const About& about, const Status& status, Time now) {
  std::unordered_map<std::string, Seen>& seen = side_of(call.caller).seen;
  const std::string key = key_of(call, about, status);
  const auto found = seen.find(key);
  if (found != seen.end() && now - found->second.written_at < kSameRefusal) {
    ++found->second.repeated;
    return std::nullopt;
  }
  std::optional<Unwritten> unwritten = take(call.caller, now);
  if (!unwritten) {
    return std::nullopt;
  }
  if (found != seen.end()) {
    unwritten->repeated = found->second.repeated;
    found->second = {now, 0};
    return unwritten;
  }
  if (seen.size() >= kMostRemembered) {
    std::erase_if(seen, [now](const auto& entry) { return now - entry.second.written_at >= kSameRefusal; });
  }
  if (seen.size() < kMostRemembered) {
    seen.emplace(key, Seen{now, 0});
  }
  return unwritten;
}

}  // namespace lightmill
