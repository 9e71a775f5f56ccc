// Why a farm cannot be reached, in words: gRPC says of most handshakes only that they failed.
#pragma once

#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/security/tls_files.h"

namespace lightmill {

/// Connects to HOST:PORT as a caller with `texts` does (without TLS if none are given), says what is wrong and what to
/// do. Nothing if nothing listens there, or nothing seems wrong. Waits some seconds at most.
std::optional<std::string> connection_problem(const std::string& address, const TlsTexts& texts);

/// Whether the coordinator at the other end of a socket, which may still be connecting, begins to speak HTTP/2 with
/// somebody who shows nothing. UNAVAILABLE. Waits some seconds at most; the socket blocks then.
Status check_answers(int socket, bool encrypted);

}  // namespace lightmill
