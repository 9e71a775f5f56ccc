#include "server/api/grpc_log.h"

#include <grpc/support/log.h>
#include <spdlog/spdlog.h>

#include <string_view>

#include "server/listen/handshake_log.h"

namespace lightmill {
namespace {

/// gRPC tells only its log why a handshake failed: "Handshake failed with fatal error SSL_ERROR_SSL: error:0A000086:SSL
/// routines::certificate verify failed." The reason, or empty for another line.
std::string_view handshake_problem(std::string_view line) {
  const std::size_t reason = line.rfind("::");
  if (!line.starts_with("Handshake failed with fatal error") || reason == std::string_view::npos) {
    return {};
  }
  line.remove_prefix(reason + 2);
  return line.ends_with('.') ? line.substr(0, line.size() - 1) : line;
}

}  // namespace

void redirect_grpc_log() {
  gpr_set_log_function([](gpr_log_func_args* line) {
    static HandshakeLog handshakes("--listen");
    if (const std::string_view reason = handshake_problem(line->message); !reason.empty()) {
      handshakes.add({}, reason);
    } else {
      spdlog::debug("grpc: {}", line->message);
    }
  });
}

}  // namespace lightmill
