// The files that a program shows who it is with, and knows others by; checked before they are used.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"
#include "common/security/certificate.h"

namespace lightmill {

/// Paths; empty: not given.
struct TlsFiles {
  std::string authority;    ///< whose certificates are believed
  std::string certificate;  ///< its own, and those between it and an authority
  std::string key;          ///< its private key; not given: in the certificate's file

  bool given() const { return !authority.empty() || !certificate.empty(); }
  const std::string& key_file() const { return key.empty() ? certificate : key; }
};

/// Their contents, PEM; empty where the file was not given.
struct TlsTexts {
  std::string authority, certificate, key;
  bool given() const { return !authority.empty() || !certificate.empty(); }
};

/// The names of the three options, for errors.
inline constexpr const char* kAuthorityOption = "--tls-ca";
inline constexpr const char* kCertificateOption = "--tls-cert";
inline constexpr const char* kKeyOption = "--tls-key";

/// Reads those that are given. Errors name option and file, and say what to do: a key without its certificate, one that
/// does not belong to it, one that everybody on this machine can read, a certificate that has ended or does not hold
/// yet, an authority that is none.
Result<TlsTexts> read_tls_files(const TlsFiles& files, std::int64_t now_unix_s);

/// FAILED_PRECONDITION if everybody on this machine can read the file that holds `what`.
Status check_secrecy(const std::string& file, std::string_view what);

/// One more check for a program that listens: INVALID_ARGUMENT unless the certificate names hosts.
Status check_names_hosts(const TlsTexts& texts);

}  // namespace lightmill
