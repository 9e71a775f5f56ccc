#include "common/security/certificate.h"

#include <arpa/inet.h>

#include <array>
#include <ctime>

#include "common/security/openssl_handles.h"

namespace lightmill {
namespace {

std::string text_of(const ASN1_STRING* string) {
  unsigned char* utf8 = nullptr;
  const int size = string == nullptr ? -1 : ASN1_STRING_to_UTF8(&utf8, string);
  if (size < 0) {
    return "";
  }
  std::string text(reinterpret_cast<const char*>(utf8), static_cast<std::size_t>(size));
  OPENSSL_free(utf8);
  return text;
}

/// The last common name, which is the most specific.
std::string common_name(const X509_NAME* name) {
  int index = -1, last = -1;
  while ((index = X509_NAME_get_index_by_NID(name, NID_commonName, index)) >= 0) {
    last = index;
  }
  return last < 0 ? "" : text_of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, last)));
}

Result<std::int64_t> unix_seconds(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) {
    return invalid_argument("its time of validity is damaged");
  }
  return static_cast<std::int64_t>(::timegm(&parts));
}

std::string address_text(const ASN1_OCTET_STRING* bytes) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const int family = ASN1_STRING_length(bytes) == 4 ? AF_INET : ASN1_STRING_length(bytes) == 16 ? AF_INET6 : 0;
  return family != 0 && ::inet_ntop(family, ASN1_STRING_get0_data(bytes), text.data(), text.size()) != nullptr
             ? text.data()
             : "";
}

void read_alternative_names(const X509* certificate, CertificateFacts& facts) {
  const openssl::Names names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* const name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type == GEN_DNS) {
      facts.hosts.push_back(text_of(name->d.dNSName));
    } else if (name->type == GEN_IPADD) {
      facts.hosts.push_back(address_text(name->d.iPAddress));
    } else if (name->type == GEN_URI) {
      add_role_of_uri(text_of(name->d.uniformResourceIdentifier), facts.roles);
    }
  }
}

Result<CertificateFacts> facts_of(X509* certificate) {
  CertificateFacts facts;
  facts.name = common_name(X509_get_subject_name(certificate));
  facts.issuer = common_name(X509_get_issuer_name(certificate));
  facts.authority = X509_check_ca(certificate) > 0;
  LM_ASSIGN_OR_RETURN(facts.from_unix_s, unix_seconds(X509_get0_notBefore(certificate)));
  LM_ASSIGN_OR_RETURN(facts.until_unix_s, unix_seconds(X509_get0_notAfter(certificate)));
  unsigned size = 0;
  if (X509_digest(certificate, EVP_sha256(), facts.fingerprint.bytes.data(), &size) != 1) {
    return internal_error("cannot take a certificate's fingerprint: {}", openssl::last_error());
  }
  read_alternative_names(certificate, facts);
  return facts;
}

}  // namespace

Result<std::vector<CertificateFacts>> read_certificates(std::string_view pem) {
  LM_ASSIGN_OR_RETURN(const std::vector<openssl::Certificate> all, openssl::certificates_in(pem));
  std::vector<CertificateFacts> facts;
  for (const openssl::Certificate& certificate : all) {
    LM_ASSIGN_OR_RETURN(facts.emplace_back(), facts_of(certificate.get()));
  }
  return facts;
}

std::string date_text(std::int64_t unix_s) {
  const auto time = static_cast<std::time_t>(unix_s);
  std::tm parts{};
  std::array<char, 64> text{};
  if (::gmtime_r(&time, &parts) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &parts) == 0) {
    return fmt::format("{} s after 1970", unix_s);
  }
  return text.data();
}

}  // namespace lightmill
