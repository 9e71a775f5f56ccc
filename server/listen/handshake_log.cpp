#include "server/listen/handshake_log.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace lightmill {

void HandshakeLog::add(std::string_view peer, std::string_view reason) {
  std::uint64_t left_out = 0;
  {
    const MutexLock lock(mutex_);
    if (!bucket_.take(system_clock().now())) {
      ++left_out_;
      return;
    }
    left_out = std::exchange(left_out_, 0);
  }
  spdlog::warn("a TLS handshake on the port of {}{}{} failed: {}{}", option_, peer.empty() ? "" : " with ", peer,
               reason, left_out == 0 ? "" : fmt::format(" ({} more were not logged)", left_out));
}

}  // namespace lightmill
