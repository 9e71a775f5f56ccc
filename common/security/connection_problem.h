// The reason for a failed connection to a farm, in words. gRPC only says that a handshake failed.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/security/tls_files.h"

namespace lightmill {

/// Connects to HOST:PORT with the credentials of `texts` (without TLS if there are none), and says what is wrong and
/// what to do. Nothing if nothing listens there, or no problem is found. Waits some seconds at most.
std::optional<std::string> connection_problem(const std::string& address, const TlsTexts& texts);

/// What gRPC's message about a coordinator without an answer means, for people, with what to do.
std::string_view cause_of_silence(std::string_view grpc_message);

/// Whether the coordinator at the other end of a socket answers a call of its health service, which needs no
/// credentials. Any answer will do. The socket may still be connecting. UNAVAILABLE if none comes within some seconds.
/// Afterwards the socket is blocking.
Status check_answers(int socket, bool encrypted);

}  // namespace lightmill
