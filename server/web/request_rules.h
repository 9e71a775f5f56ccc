// Which requests a browser may have been talked into by another page: they are refused before anything is looked at.
#pragma once

#include <span>
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

/// By which names the page may be called.
struct HostRules {
  std::span<const std::string> certified;  ///< those in the coordinator's certificate
  std::span<const std::string> named;      ///< by --http-name
  bool encrypted = false;                  ///< connections are
};

/// Whether it is NAME:PORT or [ADDRESS]:PORT, with or without the port.
bool is_host(std::string_view text);

/// PERMISSION_DENIED unless the request calls the coordinator by one of those names, by localhost or by an address: a
/// page of elsewhere whose name is made to resolve to this machine calls it by that name. Any port will do, since
/// tunnels have theirs.
Status check_host(const RequestOrigin& request, const HostRules& rules);

/// Of requests that change something, and of WebSockets. PERMISSION_DENIED if a page of another origin sent it;
/// programs that are no browsers say nothing of that, and may. By a name of --http-name, what is not encrypted here may
/// be so between the browser and a proxy.
Status check_origin(const RequestOrigin& request, const HostRules& rules);

/// Of a request with a body: INVALID_ARGUMENT unless it says that it is of this type, which is to be one that pages of
/// elsewhere cannot say without asking first, as application/json.
Status check_content_type(std::string_view content_type, std::string_view wanted);

}  // namespace lightmill
