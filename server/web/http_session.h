// HTTP requests of one connection: the page's files, the API, and the upgrade to a WebSocket.
#pragma once

#include "server/web/web_parts.h"

namespace lightmill {

/// Serves the connection from `peer` (ADDRESS:PORT) until it ends. Encrypted if `parts` has a certificate.
void start_http_session(WebParts& parts, boost::asio::ip::tcp::socket&& socket, const std::string& peer);

}  // namespace lightmill
