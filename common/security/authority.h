// A private certificate authority, and the certificates that it issues to servers, workers and people.
//
// Keys are ECDSA on P-256. Serial numbers are random. Certificates state their permitted use, so that a worker cannot
// pose as the coordinator.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/security/roles.h"

namespace lightmill {

/// The longest common name of X.509.
inline constexpr std::size_t kMaxCommonNameBytes = 64;

struct Validity {
  std::int64_t from_unix_s = 0, until_unix_s = 0;
};

/// Both as PEM; the key (PKCS #8) has no password.
struct KeyAndCertificate {
  std::string key, certificate;
};

/// A self-signed authority. INVALID_ARGUMENT if check_name refuses the name, or it is empty or too long.
Result<KeyAndCertificate> make_authority(std::string_view name, const Validity& validity);

/// The subject of a certificate: a coordinator with hosts, or a worker or person with roles.
struct CertificateSubject {
  std::string name;
  std::vector<std::string> hosts;  ///< DNS names and IP addresses of the coordinator
  Roles roles;
};

/// INVALID_ARGUMENT for names as above, invalid hosts, and hosts together with roles, or neither. Also if the
/// authority's key and certificate do not match, or its validity ends earlier.
Result<KeyAndCertificate> issue_certificate(const KeyAndCertificate& authority, const CertificateSubject& subject,
                                            const Validity& validity);

}  // namespace lightmill
