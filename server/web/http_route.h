// The paths of operations over HTTP, and what they and their queries say of a request.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/operations/operation.h"

namespace lightmill {

/// What a path means.
struct HttpRoute {
  const Operation* operation;
  bool post;               ///< else GET
  std::string_view field;  ///< of the path's parameter; empty: it has none
  std::string value;       ///< of the same
  std::string_view query;  ///< fields that the query may have
};
/// `path` is what stands behind /api/v1/. One that is asked for by the other method, if no other fits.
std::optional<HttpRoute> find_route(std::string_view path, bool post);

/// Puts the path's parameter, and what the query has of its fields, into the request. INVALID_ARGUMENT.
Status fill_request(const HttpRoute& route, std::string_view query, WireMessage& request);

}  // namespace lightmill
