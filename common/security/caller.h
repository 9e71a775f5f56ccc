// How a worker or a person shows a farm who it is: by a certificate, or by a token.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/status.h"
#include "common/security/tls_files.h"

namespace lightmill {

inline constexpr const char* kTokenFileOption = "--token-file";
inline constexpr const char* kTokenVariable = "LIGHTMILL_TOKEN";
/// Of the environment, where the options are not given.
inline constexpr const char* kAuthorityVariable = "LIGHTMILL_TLS_CA";
inline constexpr const char* kCertificateVariable = "LIGHTMILL_TLS_CERT";
inline constexpr const char* kKeyVariable = "LIGHTMILL_TLS_KEY";
inline constexpr const char* kTokenFileVariable = "LIGHTMILL_TOKEN_FILE";

/// As given.
struct CallerFiles {
  TlsFiles tls;
  std::string token_file;                       ///< empty: $LIGHTMILL_TOKEN, if that is set
  const char* token_option = kTokenFileOption;  ///< what errors call it
};

/// As read.
struct CallerTexts {
  TlsTexts tls;       ///< not given: the connection is not encrypted
  std::string token;  ///< empty: none

  /// The header of a call that shows the token: "authorization".
  std::string authorization() const { return "Bearer " + token; }
};

/// Reads and checks what is given. Errors name option and file, and the variables that say the same, and what to do:
/// what read_tls_files finds, a certificate without the authority of the farm that it is for, a token that is none or
/// that everybody on this machine can read, and one that would go to one of `servers` (HOST:PORT) over the network for
/// everybody to read.
Result<CallerTexts> read_caller(const CallerFiles& files, std::span<const std::string> servers,
                                std::int64_t now_unix_s);

}  // namespace lightmill
