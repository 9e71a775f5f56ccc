// Files with a program's certificate and key, and the authorities that it trusts. They are checked before use.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/security/certificate.h"

namespace lightmill {

/// Paths. Empty: not given.
struct TlsFiles {
  std::string authority;    ///< authorities that the program trusts
  std::string certificate;  ///< its own, and those between it and an authority
  std::string key;          ///< its private key; empty: it is in the certificate's file

  bool given() const { return !authority.empty() || !certificate.empty(); }
  const std::string& key_file() const { return key.empty() ? certificate : key; }
};

/// Their contents, PEM. Empty if the file was not given.
struct TlsTexts {
  std::string authority, certificate, key;
  bool given() const { return !authority.empty() || !certificate.empty(); }
};

/// The names of the three options, for errors.
inline constexpr const char* kAuthorityOption = "--tls-ca";
inline constexpr const char* kCertificateOption = "--tls-cert";
inline constexpr const char* kKeyOption = "--tls-key";

/// Reads the files that are given. Errors name option and file, and say what to do:
/// - a key without its certificate, or of another one, or that other users of this machine can read
/// - a certificate that is expired or not yet valid
/// - an authority's file without an authority
Result<TlsTexts> read_tls_files(const TlsFiles& files, std::int64_t now_unix_s);

/// FAILED_PRECONDITION if other users of this machine can read the file that holds `what`.
Status check_secrecy(const std::string& file, std::string_view what);

/// A check for programs that listen: INVALID_ARGUMENT unless the certificate names hosts.
Status check_names_hosts(const TlsTexts& texts);

}  // namespace lightmill
