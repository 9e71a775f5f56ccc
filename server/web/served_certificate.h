// Certificate of the page. It is read again when its files change, and serves new connections.
#pragma once

#include <boost/asio/ssl/context.hpp>

#include <memory>
#include <string>
#include <vector>

#include "common/security/tls_files.h"

namespace lightmill {

/// Not thread-safe.
class ServedCertificate {
 public:
  /// Without a certificate, nothing is encrypted.
  explicit ServedCertificate(TlsFiles files) : files_(std::move(files)) {}

  /// Checks the files, and loads them if they are new. Errors are those of read_tls_files(); then the loaded
  /// certificate stays.
  Status reload(std::int64_t now_unix_s);
  /// For the next connection. Null if connections are not encrypted.
  const std::shared_ptr<boost::asio::ssl::context>& context() const { return context_; }
  /// Host names in the certificate.
  const std::vector<std::string>& hosts() const { return hosts_; }

 private:
  const TlsFiles files_;
  TlsTexts texts_;
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::vector<std::string> hosts_;
};

}  // namespace lightmill
