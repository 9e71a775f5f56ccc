#include "server/access/login_sessions.h"

#include <algorithm>

namespace lightmill {

Result<std::int64_t> LoginSessions::add(std::string_view secret, const Identity& caller, std::int64_t now_unix_s) {
  make_room(caller, now_unix_s);
  if (logins_.size() >= kMaxLogins) {
    return resource_exhausted("{} browsers are logged in, which is the limit: log out in one of them", kMaxLogins);
  }
  const std::int64_t latest = now_unix_s + kLoginSeconds;
  const std::int64_t until = caller.until_unix_s == 0 ? latest : std::min(latest, caller.until_unix_s);
  logins_[sha256(secret)] = {caller, until, next_++};
  return until;
}

/// Ends expired sessions, and the caller's oldest one if the caller has too many.
void LoginSessions::make_room(const Identity& caller, std::int64_t now_unix_s) {
  std::erase_if(logins_, [now_unix_s](const auto& each) { return each.second.until_unix_s <= now_unix_s; });
  std::size_t of_one = 0;
  auto oldest = logins_.end();
  for (auto at = logins_.begin(); at != logins_.end(); ++at) {
    if (at->second.caller.token == caller.token) {
      ++of_one;
      oldest = oldest == logins_.end() || at->second.number < oldest->second.number ? at : oldest;
    }
  }
  if (of_one >= kMaxOfOne) {
    logins_.erase(oldest);
  }
}

Result<Identity> LoginSessions::identify(std::string_view secret, std::int64_t now_unix_s) const {
  const auto at = logins_.find(sha256(secret));
  if (at == logins_.end() || at->second.until_unix_s <= now_unix_s) {
    return make_error(StatusCode::kUnauthenticated,
                      "this browser is not logged in any more: its session ended, or the coordinator was restarted");
  }
  return at->second.caller;
}

void LoginSessions::keep(const std::function<bool(const Identity&)>& holds) {
  std::erase_if(logins_, [&holds](const auto& each) { return !holds(each.second.caller); });
}

void LoginSessions::remove(std::string_view secret) {
  logins_.erase(sha256(secret));
}

}  // namespace lightmill
