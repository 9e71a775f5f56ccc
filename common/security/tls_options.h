// Command line options by which a worker or a person shows a farm who it is.
#pragma once

#include <CLI/CLI.hpp>

#include "common/security/tls_files.h"

namespace lightmill {

/// --tls-ca, --tls-cert and --tls-key, each also by a variable of the environment.
inline void add_caller_tls_options(CLI::App& app, TlsFiles& files) {
  const char* const group = "Access";
  app.add_option(kAuthorityOption, files.authority,
                 "the authority that has signed the coordinator's certificate: the connection is encrypted, and made "
                 "to no other")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TLS_CA")
      ->group(group);
  app.add_option(kCertificateOption, files.certificate, "the certificate that says who asks")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TLS_CERT")
      ->group(group);
  app.add_option(kKeyOption, files.key, "its private key (default: in the certificate's file)")
      ->type_name("FILE")
      ->envname("LIGHTMILL_TLS_KEY")
      ->group(group);
}

}  // namespace lightmill
