// Owners of OpenSSL's objects, and its errors as text. For this folder only.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill::openssl {

template <auto free_function>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    free_function(object);
  }
};

using Bio = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;
using Names = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;
using Name = std::unique_ptr<GENERAL_NAME, Freed<GENERAL_NAME_free>>;
using Number = std::unique_ptr<BIGNUM, Freed<BN_free>>;
using Context = std::unique_ptr<SSL_CTX, Freed<SSL_CTX_free>>;
using Connection = std::unique_ptr<SSL, Freed<SSL_free>>;

/// The last error of OpenSSL's queue, which is emptied. "no reason given" if it was empty.
std::string last_error();

/// The certificates of a PEM text. Other parts are skipped. INVALID_ARGUMENT if there is none, or one is damaged.
Result<std::vector<Certificate>> certificates_in(std::string_view pem);
/// The private key of a PEM text. INVALID_ARGUMENT if there is none, it is damaged or has a password.
Result<Key> key_in(std::string_view pem);

}  // namespace lightmill::openssl
