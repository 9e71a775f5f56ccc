// Who asks over HTTP: by the token in the header, or by the cookie of a browser that showed a token before.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/access/login_book.h"
#include "server/runtime/farm_loop.h"
#include "server/runtime/gate.h"

namespace lightmill {

/// What a request shows of who sends it.
struct ShownLogin {
  std::optional<std::string> authorization;  ///< the header of that name
  std::string cookie;                        ///< the secret in the cookie; empty: none
};

/// What decides a cookie's name and flags.
struct CookiePlace {
  std::string host;     ///< of the request: HOST:PORT
  bool secure = false;  ///< the browser's connection is encrypted
};

/// The secret in the header Cookie, of the page at `host`: browsers send cookies to all ports of a host, so the port is
/// part of the name. Over an encrypted connection only what no unencrypted page can set. Empty if there is none.
std::string login_cookie(std::string_view cookie_header, const CookiePlace& place);
/// The header Set-Cookie that leaves the secret with the browser for so long; an empty one takes it away.
std::string set_cookie_header(const CookiePlace& place, std::string_view secret, std::int64_t seconds);

/// Belongs to the web's thread.
class Logins {
 public:
  Logins(FarmLoop& loop, const Gate& gate, const Clock& clock) : loop_(loop), gate_(gate), clock_(clock) {}

  /// A header counts more than a cookie. UNAUTHENTICATED.
  Result<Identity> identify(const ShownLogin& shown) const;
  /// Whether what let `caller` in holds still. UNAUTHENTICATED.
  Status check_still_holds(const ShownLogin& shown, const Identity& caller) const;

  struct LoggedIn {
    Identity caller;
    std::string secret;
    std::int64_t seconds = 0;  ///< it holds so long
  };
  /// Of whoever shows a token that holds; written down, as is what is refused. UNAUTHENTICATED, RESOURCE_EXHAUSTED.
  Result<LoggedIn> log_in(std::string_view token, const std::string& peer);
  void log_out(std::string_view secret) { book_.remove(secret); }

 private:
  Result<LoggedIn> try_log_in(std::string_view token, const std::string& peer);
  std::int64_t now_unix_s() const { return clock_.unix_milliseconds() / 1000; }

  FarmLoop& loop_;
  const Gate& gate_;
  const Clock& clock_;
  LoginBook book_;
};

}  // namespace lightmill
