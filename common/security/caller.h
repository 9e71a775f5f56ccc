// Credentials of a worker or a person: a certificate, or a token.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/status.h"
#include "common/security/tls_files.h"

namespace lightmill {

inline constexpr const char* kTokenFileOption = "--token-file";
inline constexpr const char* kTokenVariable = "LIGHTMILL_TOKEN";
/// Environment variables, used if the options are not given.
inline constexpr const char* kAuthorityVariable = "LIGHTMILL_TLS_CA";
inline constexpr const char* kCertificateVariable = "LIGHTMILL_TLS_CERT";
inline constexpr const char* kKeyVariable = "LIGHTMILL_TLS_KEY";
inline constexpr const char* kTokenFileVariable = "LIGHTMILL_TOKEN_FILE";

/// Whether a call failed because of who made it: the caller is unknown, may not do this, or has reached a limit.
inline bool is_refusal(const Status& status) {
  return status.code() == StatusCode::kUnauthenticated || status.code() == StatusCode::kPermissionDenied ||
         status.code() == StatusCode::kResourceExhausted;
}

/// The paths as given.
struct CallerFiles {
  TlsFiles tls;
  std::string token_file;                       ///< empty: $LIGHTMILL_TOKEN, if that is set
  const char* token_option = kTokenFileOption;  ///< its name in errors
};

/// The contents of the files.
struct CallerTexts {
  TlsTexts tls;       ///< not given: the connection is not encrypted
  std::string token;  ///< empty: none

  /// The "authorization" header of a call.
  std::string authorization() const { return "Bearer " + token; }
};

/// Reads and checks the files that are given. Errors name option, file and environment variable, and say what to do.
/// Errors are those of read_tls_files, and:
/// - a certificate without the farm's authority
/// - a token that is invalid, or that other users of this machine can read
/// - a token that would go unencrypted over the network to one of `servers` (HOST:PORT)
Result<CallerTexts> read_caller(const CallerFiles& files, std::span<const std::string> servers,
                                std::int64_t now_unix_s);

}  // namespace lightmill
