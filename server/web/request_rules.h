// Protection against cross-site requests: refuses requests that another page may have made a browser send.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// Headers that state a request's origin. Empty if it has no such header.
struct RequestOrigin {
  std::string_view host;        ///< Host
  std::string_view origin;      ///< Origin: browsers send it with every POST and WebSocket
  std::string_view fetch_site;  ///< Sec-Fetch-Site
};

/// Names by which the page may be addressed.
struct HostRules {
  std::span<const std::string> certified;  ///< in the coordinator's certificate
  std::span<const std::string> named;      ///< by --http-name
  bool encrypted = false;                  ///< connections are encrypted
};

/// Whether it is NAME:PORT or [ADDRESS]:PORT, with or without the port.
bool is_host(std::string_view text);

/// PERMISSION_DENIED unless Host is one of those names, localhost or an address. This stops DNS rebinding: a foreign
/// page whose name resolves to this machine sends that name. Any port is allowed, because tunnels have their own.
Status check_host(const RequestOrigin& request, const HostRules& rules);

/// For requests that change something, and for WebSockets. PERMISSION_DENIED if a page of another origin sent it.
/// Programs other than browsers send no such headers, and are allowed. For a name of --http-name, a proxy may provide
/// https:// while the connection here is unencrypted.
Status check_origin(const RequestOrigin& request, const HostRules& rules);

/// For a request with a body. INVALID_ARGUMENT unless its type is `wanted`. Choose a type that a foreign page cannot
/// send without a preflight request, such as application/json.
Status check_content_type(std::string_view content_type, std::string_view wanted);

}  // namespace lightmill
