// WebSocket of one viewer.
#pragma once

#include "server/web/http_body.h"
#include "server/web/web_parts.h"

namespace lightmill {

/// Answers a WebSocket upgrade, and serves the connection until it ends or `holds` returns an error.
void start_live_session(WebParts& parts, WebStream&& stream, const RequestHead& request, Call call,
                        LiveHub::Holds holds);

}  // namespace lightmill
