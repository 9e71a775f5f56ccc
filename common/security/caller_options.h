// Command line options by which a worker or a person shows a farm who it is.
#pragma once

#include <CLI/CLI.hpp>

#include "common/security/caller.h"

namespace lightmill {

/// --tls-ca, --tls-cert, --tls-key and --token-file, each also by a variable of the environment.
inline void add_caller_options(CLI::App& app, CallerFiles& files) {
  const char* const group = "Access";
  app.add_option(kAuthorityOption, files.tls.authority,
                 "the authority that has signed the coordinator's certificate: the connection is encrypted, and made "
                 "to no other")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TLS_CA")
      ->group(group);
  app.add_option(kCertificateOption, files.tls.certificate, "the certificate that says who asks")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TLS_CERT")
      ->group(group);
  app.add_option(kKeyOption, files.tls.key, "its private key (default: in the certificate's file)")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TLS_KEY")
      ->group(group);
  app.add_option(kTokenFileOption, files.token_file,
                 "a token that says who asks, in place of a certificate (default: what LIGHTMILL_TOKEN says)")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TOKEN_FILE")
      ->group(group);
}

}  // namespace lightmill
