#include "common/security/openssl_handles.h"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <new>

namespace lightmill::openssl {
namespace {

Bio reader_of(std::string_view text) {
  Bio bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  if (bio == nullptr) {
    throw std::bad_alloc();
  }
  return bio;
}

/// Instead of asking on the terminal.
int no_password(char*, int, int, void*) {
  return -1;
}

}  // namespace

std::string last_error() {
  const unsigned long code = ERR_peek_last_error();
  ERR_clear_error();
  const char* reason = code != 0 ? ERR_reason_error_string(code) : nullptr;
  return reason != nullptr ? reason : "no reason given";
}

Result<std::vector<Certificate>> certificates_in(std::string_view pem) {
  const Bio text = reader_of(pem);
  std::vector<Certificate> all;
  ERR_clear_error();
  while (X509* certificate = PEM_read_bio_X509(text.get(), nullptr, no_password, nullptr)) {
    all.emplace_back(certificate);
  }
  const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  const std::string reason = last_error();
  if (!at_end) {
    return invalid_argument("a certificate in it is damaged ({})", reason);
  }
  if (all.empty()) {
    return invalid_argument("there is no certificate in it (-----BEGIN CERTIFICATE-----)");
  }
  return all;
}

Result<Key> key_in(std::string_view pem) {
  const Bio text = reader_of(pem);
  ERR_clear_error();
  Key key(PEM_read_bio_PrivateKey(text.get(), nullptr, no_password, nullptr));
  if (key == nullptr) {
    return invalid_argument("there is no private key in it that can be read without a password ({})", last_error());
  }
  return key;
}

}  // namespace lightmill::openssl
