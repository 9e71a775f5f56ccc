#include "common/security/authority.h"

#include <arpa/inet.h>
#include <openssl/pem.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>

#include "common/base/text.h"
#include "common/security/certificate.h"
#include "common/security/openssl_handles.h"

namespace lightmill {
namespace {

using openssl::Bio;
using openssl::Certificate;
using openssl::Key;

Status failed(std::string_view what) {
  return internal_error("cannot {}: {}", what, openssl::last_error());
}

Status check_common_name(std::string_view name) {
  LM_RETURN_IF_ERROR(check_name("name", name));
  if (name.empty() || name.size() > kMaxCommonNameBytes) {
    return invalid_argument("name: must have 1 to {} bytes, got {}", kMaxCommonNameBytes, name.size());
  }
  return ok_status();
}

/// A DNS name, perhaps with * as its first label. If the last label is a number, it is not a DNS name but a mistyped
/// IPv4 address (RFC 3696, section 2).
bool is_dns_name(std::string_view host) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
           c == '_';
  };
  std::string_view rest = host.starts_with("*.") ? host.substr(2) : host;
  const std::string_view stem = rest.substr(0, rest.size() - (rest.ends_with('.') ? 1 : 0));
  const std::string_view last = stem.substr(stem.rfind('.') + 1);  // the whole stem if it has one label
  const bool number = std::ranges::all_of(last, [](char c) { return c >= '0' && c <= '9'; });
  return !rest.empty() && !number && rest.size() <= 253 && std::ranges::all_of(rest, good) && rest.front() != '.' &&
         rest.find("..") == std::string_view::npos;
}

// ---- the parts of a certificate ----

Status put_name(X509_NAME* out, std::string_view name) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(name.data());
  return X509_NAME_add_entry_by_NID(out, NID_commonName, MBSTRING_UTF8, bytes, static_cast<int>(name.size()), -1, 0) ==
                 1
             ? ok_status()
             : failed("put a name into a certificate");
}

/// 127 random bits.
Status put_serial(X509* certificate) {
  const openssl::Number number(BN_new());
  const bool done = number != nullptr && BN_rand(number.get(), 127, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
                    BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
  return done ? ok_status() : failed("draw a serial number");
}

/// `value` has the form of OpenSSL's configuration files. It must not contain user input.
Status put_extension(X509* certificate, X509* issuer, int kind, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const openssl::Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value));
  return extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1
             ? ok_status()
             : failed("put an extension into a certificate");
}

Status add_name(GENERAL_NAMES* names, int kind, ByteView bytes) {
  openssl::Name name(GENERAL_NAME_new());
  ASN1_STRING* string = kind == GEN_IPADD ? ASN1_OCTET_STRING_new() : ASN1_IA5STRING_new();
  if (name == nullptr || string == nullptr ||
      ASN1_STRING_set(string, bytes.data(), static_cast<int>(bytes.size())) != 1) {
    ASN1_STRING_free(string);
    return failed("name a host");
  }
  GENERAL_NAME_set0_value(name.get(), kind, string);
  if (sk_GENERAL_NAME_push(names, name.get()) == 0) {
    return failed("name a host");
  }
  (void)name.release();
  return ok_status();
}

Status add_host(GENERAL_NAMES* names, const std::string& host) {
  std::array<std::byte, 16> address{};
  if (::inet_pton(AF_INET, host.c_str(), address.data()) == 1) {
    return add_name(names, GEN_IPADD, std::span(address).first(4));
  }
  if (::inet_pton(AF_INET6, host.c_str(), address.data()) == 1) {
    return add_name(names, GEN_IPADD, address);
  }
  if (!is_dns_name(host)) {
    return invalid_argument("'{}' is neither a host name nor an IP address (give it without a port)", host);
  }
  return add_name(names, GEN_DNS, as_byte_view(host));
}

Status put_alternative_names(X509* certificate, const CertificateSubject& subject) {
  const openssl::Names names(GENERAL_NAMES_new());
  for (const std::string& host : subject.hosts) {
    LM_RETURN_IF_ERROR(add_host(names.get(), host));
  }
  for (const Role role : kRoles) {
    if (subject.roles.has(role)) {
      LM_RETURN_IF_ERROR(add_name(names.get(), GEN_URI, as_byte_view(role_uri(role))));
    }
  }
  return X509_add1_ext_i2d(certificate, NID_subject_alt_name, names.get(), 0, X509V3_ADD_DEFAULT) == 1
             ? ok_status()
             : failed("put names into a certificate");
}

/// A certificate with the parts that all certificates have.
Result<Certificate> blank(std::string_view name, const Validity& validity, EVP_PKEY* key) {
  Certificate certificate(X509_new());
  if (certificate == nullptr || X509_set_version(certificate.get(), X509_VERSION_3) != 1 ||
      X509_set_pubkey(certificate.get(), key) != 1 ||
      ASN1_TIME_set(X509_getm_notBefore(certificate.get()), static_cast<std::time_t>(validity.from_unix_s)) ==
          nullptr ||
      ASN1_TIME_set(X509_getm_notAfter(certificate.get()), static_cast<std::time_t>(validity.until_unix_s)) ==
          nullptr) {
    return failed("make a certificate");
  }
  LM_RETURN_IF_ERROR(put_serial(certificate.get()));
  LM_RETURN_IF_ERROR(put_name(X509_get_subject_name(certificate.get()), name));
  return certificate;
}

Result<KeyAndCertificate> as_texts(X509* certificate, EVP_PKEY* key) {
  const Bio key_text(BIO_new(BIO_s_mem())), certificate_text(BIO_new(BIO_s_mem()));
  if (key_text == nullptr || certificate_text == nullptr ||
      PEM_write_bio_PKCS8PrivateKey(key_text.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1 ||
      PEM_write_bio_X509(certificate_text.get(), certificate) != 1) {
    return failed("write a certificate");
  }
  const auto text = [](BIO* bio) {
    char* bytes = nullptr;
    const long size = BIO_get_mem_data(bio, &bytes);
    return std::string(bytes, static_cast<std::size_t>(size));
  };
  return KeyAndCertificate{text(key_text.get()), text(certificate_text.get())};
}

Status sign(X509* certificate, EVP_PKEY* key) {
  return X509_sign(certificate, key, EVP_sha256()) > 0 ? ok_status() : failed("sign a certificate");
}

Result<Key> new_key() {
  Key key(EVP_EC_gen("P-256"));
  return key != nullptr ? Result<Key>(std::move(key)) : failed("make a key");
}

Status check_subject(const CertificateSubject& subject) {
  LM_RETURN_IF_ERROR(check_common_name(subject.name));
  if (subject.hosts.empty() == subject.roles.empty()) {
    return invalid_argument("a certificate needs either the hosts of a coordinator, or roles");
  }
  return ok_status();
}

}  // namespace

Result<KeyAndCertificate> make_authority(std::string_view name, const Validity& validity) {
  LM_RETURN_IF_ERROR(check_common_name(name));
  LM_ASSIGN_OR_RETURN(const Key key, new_key());
  LM_ASSIGN_OR_RETURN(const Certificate certificate, blank(name, validity, key.get()));
  LM_RETURN_IF_ERROR(put_name(X509_get_issuer_name(certificate.get()), name));
  X509* const self = certificate.get();
  LM_RETURN_IF_ERROR(put_extension(self, self, NID_basic_constraints, "critical,CA:TRUE,pathlen:0"));
  LM_RETURN_IF_ERROR(put_extension(self, self, NID_key_usage, "critical,keyCertSign,cRLSign"));
  LM_RETURN_IF_ERROR(put_extension(self, self, NID_subject_key_identifier, "hash"));
  LM_RETURN_IF_ERROR(sign(self, key.get()));
  return as_texts(self, key.get());
}

Result<KeyAndCertificate> issue_certificate(const KeyAndCertificate& authority, const CertificateSubject& subject,
                                            const Validity& validity) {
  LM_RETURN_IF_ERROR(check_subject(subject));
  LM_ASSIGN_OR_RETURN(const std::vector<Certificate> issuers, openssl::certificates_in(authority.certificate));
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> facts, read_certificates(authority.certificate));
  LM_ASSIGN_OR_RETURN(const Key authority_key, openssl::key_in(authority.key));
  X509* const issuer = issuers.front().get();
  if (!facts.front().authority || X509_check_private_key(issuer, authority_key.get()) != 1) {
    return invalid_argument("the authority's key and certificate do not match");
  }
  if (facts.front().until_unix_s <= validity.from_unix_s) {
    return invalid_argument("the authority '{}' expired {}: make a new one", facts.front().name,
                            date_text(facts.front().until_unix_s));
  }
  const Validity within{validity.from_unix_s, std::min(validity.until_unix_s, facts.front().until_unix_s)};
  LM_ASSIGN_OR_RETURN(const Key key, new_key());
  LM_ASSIGN_OR_RETURN(const Certificate made, blank(subject.name, within, key.get()));
  X509* const certificate = made.get();
  if (X509_set_issuer_name(certificate, X509_get_subject_name(issuer)) != 1) {
    return failed("name an issuer");
  }
  LM_RETURN_IF_ERROR(put_extension(certificate, issuer, NID_basic_constraints, "critical,CA:FALSE"));
  LM_RETURN_IF_ERROR(put_extension(certificate, issuer, NID_key_usage, "critical,digitalSignature"));
  LM_RETURN_IF_ERROR(
      put_extension(certificate, issuer, NID_ext_key_usage, subject.hosts.empty() ? "clientAuth" : "serverAuth"));
  LM_RETURN_IF_ERROR(put_extension(certificate, issuer, NID_subject_key_identifier, "hash"));
  LM_RETURN_IF_ERROR(put_extension(certificate, issuer, NID_authority_key_identifier, "keyid"));
  LM_RETURN_IF_ERROR(put_alternative_names(certificate, subject));
  LM_RETURN_IF_ERROR(sign(certificate, authority_key.get()));
  return as_texts(certificate, key.get());
}

}  // namespace lightmill
