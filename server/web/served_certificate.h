// The certificate under which the page is served: read again when its files change, for the connections that come
// after.
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
  /// Nothing is encrypted if none is given.
  explicit ServedCertificate(TlsFiles files) : files_(std::move(files)) {}

  /// Looks at the files, and takes what they hold if that is new. Errors as read_tls_files has them; then what was
  /// taken before stays.
  Status look(std::int64_t now_unix_s);
  /// For the next connection; null where connections are not encrypted.
  const std::shared_ptr<boost::asio::ssl::context>& context() const { return context_; }
  /// That it is for.
  const std::vector<std::string>& hosts() const { return hosts_; }

 private:
  const TlsFiles files_;
  TlsTexts texts_;
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::vector<std::string> hosts_;
};

}  // namespace lightmill
