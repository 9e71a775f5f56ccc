// Which requests a browser may have been talked into by another page: they are refused before anything is looked at.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// What a request says of where it comes from; empty where it has no such header.
struct RequestOrigin {
  std::string_view host;        ///< Host
  std::string_view origin;      ///< Origin; browsers send it with every POST and WebSocket
  std::string_view fetch_site;  ///< Sec-Fetch-Site
};

/// PERMISSION_DENIED unless the request calls this machine by a name that only it has: a page of elsewhere whose name
/// is made to resolve to 127.0.0.1 calls it by that name. Any port will do, since tunnels have theirs.
Status check_host(const RequestOrigin& request);

/// Of requests that change something, and of WebSockets. PERMISSION_DENIED if a page of another origin sent it;
/// programs that are no browsers say nothing of that, and may.
Status check_origin(const RequestOrigin& request);

/// Of a request with a body: INVALID_ARGUMENT unless it says application/json, which pages of elsewhere cannot say
/// without asking first.
Status check_json(std::string_view content_type);

}  // namespace lightmill
