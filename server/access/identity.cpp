#include "server/access/identity.h"

#include "common/base/text.h"

namespace lightmill {

Identity anonymous_identity() {
  return {"", Roles::all(), Proof::none, 0, ""};
}

Result<Identity> identity_of(const CertificateFacts& certificate, std::int64_t now_unix_s) {
  Identity identity{certificate.name, certificate.roles, Proof::certificate, certificate.until_unix_s, ""};
  if (const Status status = check_name("the certificate's name", identity.name);
      !status.ok() || identity.name.empty()) {
    return make_error(StatusCode::kUnauthenticated, "the certificate has no usable name: its common name is {}",
                      status.ok() ? "empty" : message_of(status));
  }
  if (identity.roles.empty()) {
    return make_error(StatusCode::kUnauthenticated,
                      "the certificate of '{}' has no role ({}…, as `lightmill certs person` adds)", identity.name,
                      role_uri(Role::view));
  }
  LM_RETURN_IF_ERROR(check_still_holds(identity, now_unix_s));
  return identity;
}

Result<std::string> worker_name(const Identity& identity, std::string_view said) {
  const bool slash = said.find('/') != std::string_view::npos;
  if (identity.is_known() && slash) {
    return invalid_argument(
        "a worker's name must not have a slash, got '{}'. The name of its certificate or token and a slash are put "
        "before it",
        as_name(said));
  }
  std::string name =
      identity.is_known() && said != identity.name ? fmt::format("{}/{}", identity.name, said) : std::string(said);
  LM_RETURN_IF_ERROR(check_name("a worker's name", name));
  return name;
}

std::string describe(const Identity& identity) {
  if (!identity.is_known()) {
    return "an unknown caller";
  }
  return fmt::format("'{}' (roles: {}; by {})", identity.name, names_of(identity.roles),
                     identity.proof == Proof::token ? "token " + identity.token : "certificate");
}

Status check_still_holds(const Identity& identity, std::int64_t now_unix_s) {
  return identity.until_unix_s == 0 || now_unix_s < identity.until_unix_s
             ? ok_status()
             : make_error(StatusCode::kUnauthenticated, "the certificate or token of '{}' expired {}: renew it",
                          identity.name, date_text(identity.until_unix_s));
}

}  // namespace lightmill
