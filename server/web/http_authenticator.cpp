#include "server/web/http_authenticator.h"

#include "common/security/token.h"
#include "server/runtime/action_records.h"

namespace lightmill {
namespace {

/// Browsers do not let an unencrypted page set or change a cookie with this prefix.
constexpr std::string_view kSecurePrefix = "__Host-";

std::string cookie_name(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  const bool port = colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos;
  return port ? fmt::format("lightmill-{}", host.substr(colon + 1)) : "lightmill";
}

std::string_view cookie_value(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    std::string_view pair = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(header.size(), pair.size() + 1));
    pair.remove_prefix(std::min(pair.size(), pair.find_first_not_of(' ')));
    if (pair.size() > name.size() && pair.starts_with(name) && pair[name.size()] == '=') {
      return pair.substr(name.size() + 1);
    }
  }
  return {};
}

}  // namespace

std::string login_cookie(std::string_view cookie_header, const CookieScope& scope) {
  const std::string name = cookie_name(scope.host);
  const std::string_view secure = cookie_value(cookie_header, std::string(kSecurePrefix) + name);
  return std::string(secure.empty() && !scope.secure ? cookie_value(cookie_header, name) : secure);
}

std::string set_cookie_header(const CookieScope& scope, std::string_view secret, std::int64_t seconds) {
  return fmt::format("{}{}={}; Path=/; Max-Age={}; HttpOnly; SameSite=Strict{}", scope.secure ? kSecurePrefix : "",
                     cookie_name(scope.host), secret, secret.empty() ? 0 : seconds, scope.secure ? "; Secure" : "");
}

Result<Identity> HttpAuthenticator::identify(const HttpCredentials& credentials) const {
  if (credentials.authorization) {
    return access_.identify({credentials.authorization, "", ""});
  }
  if (!credentials.cookie.empty()) {
    Result<Identity> caller = sessions_.identify(credentials.cookie, now_unix_s());
    if (const Status holds = caller.ok() ? access_.check_still_holds(*caller) : caller.status(); !holds.ok()) {
      caller = holds;
    }
    if (caller.ok() || access_.authenticates()) {
      return caller;
    }
  }
  return access_.authenticates()
             ? make_error(StatusCode::kUnauthenticated,
                          "this farm requires authentication, and got no token: log in with one, or "
                          "send it in the header 'Authorization: Bearer TOKEN'")
             : Result<Identity>(anonymous_identity());
}

Status HttpAuthenticator::check_still_holds(const HttpCredentials& credentials, const Identity& caller) const {
  if (!credentials.authorization && caller.is_known()) {
    LM_RETURN_IF_ERROR(sessions_.identify(credentials.cookie, now_unix_s()).status());
  }
  return access_.check_still_holds(caller);
}

Result<HttpAuthenticator::LoggedIn> HttpAuthenticator::try_log_in(std::string_view token, const std::string& peer) {
  LM_RETURN_IF_ERROR(access_.take_request({}, peer));
  LM_ASSIGN_OR_RETURN(Identity caller, access_.identify({fmt::format("Bearer {}", token), "", peer}));
  LM_RETURN_IF_ERROR(with_context(check_call(caller, kWatchJob), "this token cannot log in on the page"));
  LM_ASSIGN_OR_RETURN(const NewToken secret, make_token());
  sessions_.keep([this](const Identity& known) { return access_.check_still_holds(known).ok(); });
  LM_ASSIGN_OR_RETURN(const std::int64_t until, sessions_.add(secret.text, caller, now_unix_s()));
  return LoggedIn{std::move(caller), secret.text, until - now_unix_s()};
}

Result<HttpAuthenticator::LoggedIn> HttpAuthenticator::log_in(std::string_view token, const std::string& peer) {
  Result<LoggedIn> logged_in = try_log_in(token, peer);
  (void)loop_.post([&access = access_, peer, caller = logged_in.ok() ? logged_in->caller : Identity{},
                    status = logged_in.status()](FarmLoop::TaskContext& context) {
    record_login(context, access, caller, peer, status);
  });
  return logged_in;
}

}  // namespace lightmill
