// Identity of a caller, as proved by a certificate or token.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/security/certificate.h"
#include "common/security/roles.h"

namespace lightmill {

/// How a caller proved its identity.
enum class Proof {
  none,         ///< no authentication: everyone who reaches the coordinator may do everything
  certificate,  ///< signed by an authority of the farm
  token,        ///< registered in the farm
};

struct Identity {
  std::string name;  ///< also the owner of submitted jobs; empty without proof
  Roles roles;
  Proof proof = Proof::none;
  std::int64_t until_unix_s = 0;  ///< end of the certificate's or token's validity; 0: none
  std::string token;              ///< id of the token, if one was used

  bool is_known() const { return proof != Proof::none; }
};

/// The identity of callers where the farm does not authenticate.
Identity anonymous_identity();

/// UNAUTHENTICATED if the certificate has expired, or has no name or role.
Result<Identity> identity_of(const CertificateFacts& certificate, std::int64_t now_unix_s);

/// The farm's name for a worker that calls itself `said`: "NAME/said", where NAME is that of its certificate or token.
/// So no worker can impersonate another one. The name is `said` alone if that equals NAME, or without authentication.
/// INVALID_ARGUMENT if check_name() refuses the name, or if an authenticated worker's `said` has a slash.
Result<std::string> worker_name(const Identity& identity, std::string_view said);

/// "'ada' (roles: view, submit; by certificate)".
std::string describe(const Identity& identity);

/// UNAUTHENTICATED once the certificate or token has expired.
Status check_still_holds(const Identity& identity, std::int64_t now_unix_s);

}  // namespace lightmill
