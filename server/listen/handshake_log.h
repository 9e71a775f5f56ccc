// Log of TLS handshakes that failed, for the person who looks for a missing worker or browser.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "server/access/token_bucket.h"

namespace lightmill {

/// Anyone can cause such lines: after ten, at most one per minute is logged. Thread-safe.
class HandshakeLog {
 public:
  /// `option` gave the address of the port, e.g. --http.
  explicit HandshakeLog(std::string_view option) : option_(option) {}
  /// `reason` is OpenSSL's. `peer` (ADDRESS:PORT) is empty if it is unknown.
  void add(std::string_view peer, std::string_view reason);

 private:
  const std::string option_;
  Mutex mutex_;
  TokenBucket bucket_ LM_GUARDED_BY(mutex_){1.0 / 60, 10};
  std::uint64_t left_out_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill
