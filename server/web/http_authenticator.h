// Identity of HTTP requests: by a token in the header, or by the session cookie of a browser.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/access/login_sessions.h"
#include "server/runtime/access_control.h"
#include "server/runtime/farm_loop.h"

namespace lightmill {

/// Credentials in a request.
struct HttpCredentials {
  std::optional<std::string> authorization;  ///< the header of that name
  std::string cookie;                        ///< the secret in the cookie; empty: none
};

/// Properties of a request that determine the cookie's name and flags.
struct CookieScope {
  std::string host;     ///< of the request: HOST:PORT
  bool secure = false;  ///< the browser's connection is encrypted
};

/// The secret in the header Cookie for the page at `host`. Browsers send cookies to all ports of a host, so the name
/// includes the port. Over an encrypted connection, it accepts only a cookie that no unencrypted page can set. Empty if
/// there is none.
std::string login_cookie(std::string_view cookie_header, const CookieScope& scope);
/// The header Set-Cookie that stores the secret for `seconds`. An empty secret deletes it.
std::string set_cookie_header(const CookieScope& scope, std::string_view secret, std::int64_t seconds);

/// Used on the web thread.
class HttpAuthenticator {
 public:
  HttpAuthenticator(FarmLoop& loop, const AccessControl& access, const Clock& clock)
      : loop_(loop), access_(access), clock_(clock) {}

  /// A header has priority over a cookie. UNAUTHENTICATED.
  Result<Identity> identify(const HttpCredentials& credentials) const;
  /// Whether the credentials of `caller` are still valid. UNAUTHENTICATED.
  Status check_still_holds(const HttpCredentials& credentials, const Identity& caller) const;

  struct LoggedIn {
    Identity caller;
    std::string secret;
    std::int64_t seconds = 0;  ///< lifetime
  };
  /// Starts a session for a valid token. Attempts are logged, including refused ones. UNAUTHENTICATED,
  /// RESOURCE_EXHAUSTED.
  Result<LoggedIn> log_in(std::string_view token, const std::string& peer);
  void log_out(std::string_view secret) { sessions_.remove(secret); }

 private:
  Result<LoggedIn> try_log_in(std::string_view token, const std::string& peer);
  std::int64_t now_unix_s() const { return clock_.unix_milliseconds() / 1000; }

  FarmLoop& loop_;
  const AccessControl& access_;
  const Clock& clock_;
  LoginSessions sessions_;
};

}  // namespace lightmill
