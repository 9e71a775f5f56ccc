// The WebSocket of one viewer.
#pragma once

#include "server/web/http_body.h"
#include "server/web/web_parts.h"

namespace lightmill {

/// Answers a request that asks for a WebSocket, and serves it as long as it lasts: as long as `holds` says so of what
/// the caller has shown.
void start_live_session(WebParts& parts, WebStream&& stream, const RequestHead& request, Call call,
                        LiveHub::Holds holds);

}  // namespace lightmill
