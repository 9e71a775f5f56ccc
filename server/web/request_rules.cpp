#include "server/web/request_rules.h"

#include "common/base/address.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

/// Without port and brackets.
std::string host_name(std::string_view host) {
  if (host.starts_with('[')) {
    return std::string(host.substr(1, host.find(']') - 1));
  }
  return std::string(host.substr(0, host.find(':')));
}

}  // namespace

Status check_host(const RequestOrigin& request) {
  if (is_loopback(host_name(request.host))) {
    return ok_status();
  }
  return make_error(StatusCode::kPermissionDenied,
                    "this page is served to its own machine alone: call it localhost or 127.0.0.1, not '{}'",
                    printable(request.host));
}

Status check_origin(const RequestOrigin& request) {
  const bool same_origin = request.origin.empty() || request.origin == "http://" + std::string(request.host);
  const bool same_site =
      request.fetch_site.empty() || request.fetch_site == "same-origin" || request.fetch_site == "none";
  return same_origin && same_site
             ? ok_status()
             : make_error(StatusCode::kPermissionDenied, "a page of another origin ('{}') asked for this",
                          printable(request.origin));
}

Status check_json(std::string_view content_type) {
  const std::string_view type = content_type.substr(0, content_type.find(';'));
  return type == "application/json"
             ? ok_status()
             : invalid_argument("the Content-Type must be application/json, got '{}'", printable(content_type));
}

}  // namespace lightmill
