// One connection's requests: the page's files, the API, and the way to the WebSocket.
#pragma once

#include "server/web/web_parts.h"

namespace lightmill {

/// Serves the connection from `peer` (ADDRESS:PORT) until it ends; encrypted, if `parts` has a certificate.
void start_http_session(WebParts& parts, boost::asio::ip::tcp::socket&& socket, const std::string& peer);

}  // namespace lightmill
