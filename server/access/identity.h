// Who calls, as far as they have shown it.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/security/certificate.h"
#include "common/security/roles.h"

namespace lightmill {

/// What somebody is known by.
enum class Proof {
  none,         ///< nothing is asked for: whoever reaches the coordinator may do everything
  certificate,  ///< one that an authority of the farm has signed
  token,        ///< one that the farm knows
};

struct Identity {
  std::string name;  ///< also the owner of what is submitted; empty without proof
  Roles roles;
  Proof proof = Proof::none;
  std::int64_t until_unix_s = 0;  ///< what was shown holds so long; 0: without end
  std::string token;              ///< its id, if that was shown

  bool is_known() const { return proof != Proof::none; }
};

/// Of callers where nothing is asked for.
Identity anybody();

/// UNAUTHENTICATED if the certificate has ended, names nobody or gives no role.
Result<Identity> identity_of(const CertificateFacts& certificate, std::int64_t now_unix_s);

/// The name under which a farm knows a worker that says it is `said`: "NAME/said", NAME being that of its certificate
/// or token, so that nobody can pose as another's; just `said` where that is NAME, or nobody is known. INVALID_ARGUMENT
/// for what check_name refuses.
Result<std::string> worker_name(const Identity& identity, std::string_view said);

/// "'ada' (roles: view, submit; by certificate)".
std::string describe(const Identity& identity);

/// UNAUTHENTICATED once what was shown has ended.
Status check_still_holds(const Identity& identity, std::int64_t now_unix_s);

}  // namespace lightmill
