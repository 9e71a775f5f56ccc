// The contents of a certificate: name, roles and validity.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/security/roles.h"

namespace lightmill {

struct CertificateFacts {
  std::string name;                ///< common name of the subject
  std::string issuer;              ///< common name of the issuer
  std::vector<std::string> hosts;  ///< DNS names and IP addresses
  Roles roles;                     ///< from its URIs (role_uri)
  bool authority = false;          ///< may sign others
  std::int64_t from_unix_s = 0, until_unix_s = 0;
  Sha256 fingerprint;  ///< of the DER form, as `openssl x509 -fingerprint -sha256` shows it
};

/// The facts of each certificate in a PEM text, in its order. INVALID_ARGUMENT if there is none.
Result<std::vector<CertificateFacts>> read_certificates(std::string_view pem);

/// "2027-03-01 12:00 UTC".
std::string date_text(std::int64_t unix_s);

}  // namespace lightmill
