#include "common/security/caller.h"

#include <cstdlib>

#include "common/base/address.h"
#include "common/base/file.h"
#include "common/security/token.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMaxTokenFileBytes = 4'096;
constexpr const char* kBlanks = " \t\r\n";

Result<std::string> read_token(const std::string& file, const char* option) {
  std::string where = kTokenVariable, text;
  if (!file.empty()) {
    where = fmt::format("{} {}", option, file);
    const Result<std::string> read = read_file(file, kMaxTokenFileBytes);
    if (read.ok() && read->find_first_not_of(kBlanks) == std::string::npos) {
      return invalid_argument("{}: the file is empty: `lightmill tokens create` prints a token for it", where);
    }
    const Status secret = check_secrecy(file, "the token");
    if (!secret.ok() || !read.ok()) {
      return invalid_argument("{}: {}", where, message_of(secret.ok() ? read.status() : secret));
    }
    text = *read;
  } else if (const char* const variable = std::getenv(kTokenVariable); variable != nullptr) {
    text = variable;
  }
  text.erase(text.find_last_not_of(kBlanks) + 1);
  if (text.empty() && file.empty()) {
    return text;
  }
  const Result<std::string> id = token_id(text);
  return id.ok() ? Result<std::string>(std::move(text)) : with_context(id.status(), where);
}

/// Users who set environment variables did not type the options that an error names. Names the variables of the files in
/// `message`, or of all files if it has none.
std::string with_variables(const CallerFiles& files, const std::string& message) {
  const auto named = [&](const std::string& file) { return !file.empty() && message.find(file) != message.npos; };
  const bool any =
      named(files.tls.authority) || named(files.tls.certificate) || named(files.tls.key) || named(files.token_file);
  std::string set;
  for (const auto& [variable, file] :
       {std::pair(kAuthorityVariable, &files.tls.authority), std::pair(kCertificateVariable, &files.tls.certificate),
        std::pair(kKeyVariable, &files.tls.key), std::pair(kTokenFileVariable, &files.token_file)}) {
    if (const char* const value = std::getenv(variable);
        value != nullptr && !file->empty() && *file == value && (!any || named(*file))) {
      set += fmt::format("{}{}", set.empty() ? "" : ", ", variable);
    }
  }
  return set.empty() ? "" : fmt::format(" (set in the environment: {})", set);
}

Result<CallerTexts> read(const CallerFiles& files, std::span<const std::string> servers, std::int64_t now_unix_s) {
  if (!files.tls.certificate.empty() && files.tls.authority.empty()) {
    return invalid_argument("{} is given without {}, the authority of its farm", kCertificateOption, kAuthorityOption);
  }
  CallerTexts caller;
  LM_ASSIGN_OR_RETURN(caller.tls, read_tls_files(files.tls, now_unix_s));
  LM_ASSIGN_OR_RETURN(caller.token, read_token(files.token_file, files.token_option));
  for (const std::string& server : servers) {
    const Result<HostPort> address = parse_host_port(server);
    if (!caller.token.empty() && !caller.tls.given() && address.ok() && !is_loopback(address->host)) {
      return failed_precondition("the token would go to {} unencrypted: give {}, which encrypts the connection", server,
                                 kAuthorityOption);
    }
  }
  return caller;
}

}  // namespace

Result<CallerTexts> read_caller(const CallerFiles& files, std::span<const std::string> servers,
                                std::int64_t now_unix_s) {
  Result<CallerTexts> caller = read(files, servers, now_unix_s);
  return caller.ok() ? std::move(caller)
                     : make_error(caller.status().code(), "{}{}", message_of(caller.status()),
                                  with_variables(files, message_of(caller.status())));
}

}  // namespace lightmill
