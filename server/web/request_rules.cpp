#include "server/web/request_rules.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

#include "common/base/text.h"

namespace lightmill {
namespace {

/// Lower case, without port and brackets.
std::string bare_host(std::string_view host) {
  const bool bracket = host.starts_with('[') && host.find(']') != std::string_view::npos;
  std::string name(bracket ? host.substr(1, host.find(']') - 1) : host.substr(0, host.find(':')));
  std::ranges::transform(name, name.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return name;
}

bool is_address(const std::string& name) {
  std::array<unsigned char, 16> bytes{};
  return ::inet_pton(AF_INET, name.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, name.c_str(), bytes.data()) == 1;
}

/// Whether it is one of `names`. "*.example" matches every name with one more label.
bool is_among(const std::string& name, std::span<const std::string> names) {
  return std::ranges::any_of(names, [&](const std::string& each) {
    const std::string known = bare_host(each);
    const std::size_t dot = name.find('.');
    return name == known ||
           (known.starts_with("*.") && dot != std::string::npos && name.substr(dot) == known.substr(1));
  });
}

}  // namespace

bool is_host(std::string_view host) {
  const std::size_t end = host.starts_with('[') ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  const std::string_view name = host.substr(0, end), port = host.substr(end);
  const auto consists_of = [](std::string_view text, std::string_view allowed) {
    return text.find_first_not_of(allowed) == std::string_view::npos;
  };
  static constexpr std::string_view kOfNames = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._";
  return !name.empty() && (name.starts_with('[') || consists_of(name, kOfNames)) &&
         (port.empty() || (port.starts_with(':') && consists_of(port.substr(1), "0123456789")));
}

Status check_host(const RequestOrigin& request, const HostRules& rules) {
  const std::string name = bare_host(request.host);
  if (name == "localhost" || is_address(name) || is_among(name, rules.certified) || is_among(name, rules.named)) {
    return ok_status();
  }
  return make_error(StatusCode::kPermissionDenied,
                    "'{}' is not a name of this page: use its address, localhost or a name in the coordinator's "
                    "certificate, or add the name with --http-name",
                    printable(request.host));
}

Status check_origin(const RequestOrigin& request, const HostRules& rules) {
  const std::string host(request.host);
  const bool proxied = !rules.encrypted && is_among(bare_host(host), rules.named);
  const bool same_origin = request.origin.empty() ||
                           request.origin == (rules.encrypted ? "https://" : "http://") + host ||
                           (proxied && request.origin == "https://" + host);
  const bool same_site =
      request.fetch_site.empty() || request.fetch_site == "same-origin" || request.fetch_site == "none";
  return same_origin && same_site
             ? ok_status()
             : make_error(StatusCode::kPermissionDenied, "a page of another origin ('{}') sent this request",
                          printable(request.origin));
}

Status check_content_type(std::string_view content_type, std::string_view wanted) {
  return content_type.substr(0, content_type.find(';')) == wanted
             ? ok_status()
             : invalid_argument("the Content-Type must be {}, got '{}'", wanted, printable(content_type));
}

}  // namespace lightmill
