// A private certificate authority: makes itself, and certificates for servers, workers and people.
//
// Keys are ECDSA on P-256, serial numbers random. What it signs says for what it may be used, so that a worker cannot
// pose as the coordinator.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/security/roles.h"

namespace lightmill {

/// X.509 allows no longer ones.
inline constexpr std::size_t kMaxCommonNameBytes = 64;

struct Validity {
  std::int64_t from_unix_s = 0, until_unix_s = 0;
};

/// Both as PEM; the key (PKCS #8) has no password.
struct KeyAndCertificate {
  std::string key, certificate;
};

/// Signs itself. INVALID_ARGUMENT for a name that check_name refuses, an empty or too long one.
Result<KeyAndCertificate> make_authority(std::string_view name, const Validity& validity);

/// Whose certificate it is to be: a coordinator's with hosts, or a worker's or person's with roles.
struct CertificateSubject {
  std::string name;
  std::vector<std::string> hosts;  ///< DNS names and IP addresses at which the coordinator is reached
  Roles roles;
};

/// INVALID_ARGUMENT for names as above, hosts that are none, hosts together with roles or neither, and where the
/// authority's key and certificate do not belong together or it has ended before.
Result<KeyAndCertificate> issue_certificate(const KeyAndCertificate& authority, const CertificateSubject& subject,
                                            const Validity& validity);

}  // namespace lightmill
