#include "common/security/tls_files.h"

#include <sys/stat.h>

#include "common/base/file.h"
#include "common/security/openssl_handles.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMaxFileBytes = 1 << 20;

std::string place(const char* option, const std::string& file) {
  return fmt::format("{} {}", option, file);
}

Status check_time(const CertificateFacts& facts, std::int64_t now_unix_s) {
  if (now_unix_s >= facts.until_unix_s) {
    return failed_precondition("the certificate of '{}' expired {}: renew it", facts.name,
                               date_text(facts.until_unix_s));
  }
  if (now_unix_s < facts.from_unix_s) {
    return failed_precondition("the certificate of '{}' is valid from {}: check this machine's clock", facts.name,
                               date_text(facts.from_unix_s));
  }
  return ok_status();
}

Result<std::string> read_authority(const std::string& file, std::int64_t now_unix_s) {
  LM_ASSIGN_OR_RETURN(std::string pem, read_file(file, kMaxFileBytes));
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> all, read_certificates(pem));
  if (!all.front().authority) {
    return failed_precondition("the certificate of '{}' is not that of an authority", all.front().name);
  }
  if (all.size() == 1) {  // if there are several, some may be expired
    LM_RETURN_IF_ERROR(check_time(all.front(), now_unix_s));
  }
  return pem;
}

Result<std::string> read_certificate(const std::string& file, std::int64_t now_unix_s) {
  LM_ASSIGN_OR_RETURN(std::string pem, read_file(file, kMaxFileBytes));
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> all, read_certificates(pem));
  LM_RETURN_IF_ERROR(check_time(all.front(), now_unix_s));
  return pem;
}

Result<std::string> read_key(const std::string& file, const std::string& certificate_pem) {
  LM_ASSIGN_OR_RETURN(std::string pem, read_file(file, kMaxFileBytes));
  LM_ASSIGN_OR_RETURN(const openssl::Key key, openssl::key_in(pem));
  LM_RETURN_IF_ERROR(check_secrecy(file, "the private key"));
  LM_ASSIGN_OR_RETURN(const std::vector<openssl::Certificate> all, openssl::certificates_in(certificate_pem));
  if (X509_check_private_key(all.front().get(), key.get()) != 1) {
    return failed_precondition("the private key in it does not match the certificate");
  }
  return pem;
}

}  // namespace

Result<TlsTexts> read_tls_files(const TlsFiles& files, std::int64_t now_unix_s) {
  TlsTexts texts;
  if (files.certificate.empty() && !files.key.empty()) {
    return invalid_argument("{} is given without its certificate ({})", kKeyOption, kCertificateOption);
  }
  if (!files.authority.empty()) {
    LM_ASSIGN_OR_RETURN(texts.authority, with_context(read_authority(files.authority, now_unix_s),
                                                      place(kAuthorityOption, files.authority)));
  }
  if (!files.certificate.empty()) {
    LM_ASSIGN_OR_RETURN(texts.certificate, with_context(read_certificate(files.certificate, now_unix_s),
                                                        place(kCertificateOption, files.certificate)));
    const char* const option = files.key.empty() ? kCertificateOption : kKeyOption;
    LM_ASSIGN_OR_RETURN(texts.key,
                        with_context(read_key(files.key_file(), texts.certificate), place(option, files.key_file())));
  }
  return texts;
}

Status check_secrecy(const std::string& file, std::string_view what) {
  struct stat info {};
  if (::stat(file.c_str(), &info) == 0 && (info.st_mode & S_IROTH) != 0) {
    return failed_precondition("other users of this machine can read {} in it. Run `chmod 600 {}`", what, file);
  }
  return ok_status();
}

Status check_names_hosts(const TlsTexts& texts) {
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> all, read_certificates(texts.certificate));
  return all.front().hosts.empty()
             ? invalid_argument(
                   "the certificate of '{}' names no host, so clients cannot check it: make one with `lightmill certs "
                   "server`",
                   all.front().name)
             : ok_status();
}

}  // namespace lightmill
