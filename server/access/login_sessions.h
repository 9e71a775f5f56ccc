// Sessions of the page: for each secret in a browser's cookie, the identity behind it, and when it expires.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

/// Not thread-safe. Keeps only the SHA-256 of a secret, in memory. Sessions end when the coordinator restarts.
class LoginSessions {
 public:
  /// Longest session. It ends earlier with its token.
  static constexpr std::int64_t kLoginSeconds = std::int64_t{7} * 24 * 60 * 60;
  static constexpr std::size_t kMaxLogins = 2'000;
  /// Sessions of one token. A new one replaces the oldest.
  static constexpr std::size_t kMaxOfOne = 100;

  /// Starts a session for `caller`, who authenticated with a token. Returns its end. RESOURCE_EXHAUSTED.
  Result<std::int64_t> add(std::string_view secret, const Identity& caller, std::int64_t now_unix_s);
  /// UNAUTHENTICATED if the secret is unknown or has expired. Does not check whether the token is still valid.
  Result<Identity> identify(std::string_view secret, std::int64_t now_unix_s) const;
  /// Ends the sessions whose callers fail `holds`.
  void keep(const std::function<bool(const Identity&)>& holds);
  /// Ends the session.
  void remove(std::string_view secret);
  std::size_t size() const { return logins_.size(); }

 private:
  struct Login {
    Identity caller;
    std::int64_t until_unix_s = 0;
    std::uint64_t number = 0;
  };
  void make_room(const Identity& caller, std::int64_t now_unix_s);

  std::map<Sha256, Login> logins_;
  std::uint64_t next_ = 1;
};

}  // namespace lightmill
