// Command line options for the credentials of a worker or a person.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "common/security/caller.h"

namespace lightmill {

/// --tls-ca, --tls-cert, --tls-key and --token-file, each with an environment variable.
inline void add_caller_options(CLI::App& app, CallerFiles& files, const char* group = "Access") {
  const auto add = [&app, group](const char* option, std::string& file, const char* text, const char* variable) {
    // CLI11 applies environment variables to the options of all commands. Only commands that run may use them, and
    // values on the command line have priority.
    app.add_option_function<std::string>(
           option,
           [&app, &file, variable](const std::string& given) {
             const char* const set = std::getenv(variable);
             if (app.parsed() && (file.empty() || set == nullptr || given != set)) {
               file = given;
             }
           },
           text)
        ->type_name("FILE")
        ->envname(variable)
        ->group(group);
  };
  add(kAuthorityOption, files.tls.authority, "the authority of the coordinator's certificate; encrypts the connection",
      kAuthorityVariable);
  add(kCertificateOption, files.tls.certificate, "the certificate that authenticates the caller", kCertificateVariable);
  add(kKeyOption, files.tls.key, "its private key, if it is in a file of its own", kKeyVariable);
  add(kTokenFileOption, files.token_file,
      "a file with a token, instead of a certificate; LIGHTMILL_TOKEN can hold the token itself", kTokenFileVariable);
}

}  // namespace lightmill
