// Why a farm cannot be reached, in words: gRPC says of most handshakes only that they failed.
#pragma once

#include <optional>
#include <string>

#include "common/security/tls_files.h"

namespace lightmill {

/// Connects to HOST:PORT as a caller with `texts` does (without TLS if none are given), says what is wrong and what to
/// do. Nothing if nothing listens there, or nothing seems wrong. Waits some seconds at most.
std::optional<std::string> connection_problem(const std::string& address, const TlsTexts& texts);

}  // namespace lightmill
