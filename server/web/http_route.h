// HTTP paths of operations, and the parameters in paths and queries.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/operations/operation.h"

namespace lightmill {

/// An operation's path that matches a request.
struct HttpRoute {
  const Operation* operation;
  bool post;               ///< otherwise GET
  std::string_view field;  ///< field of the path's parameter; empty: none
  std::string value;       ///< value of the path's parameter
  std::string_view query;  ///< fields that the query may have
};
/// `path` is the part after /api/v1/. If no route fits, returns one with the other method.
std::optional<HttpRoute> find_route(std::string_view path, bool post);

/// The page that a job belongs to, a parameter of the query of POST jobs. It is no field of the request.
inline constexpr std::string_view kPageParameter = "page";

/// Copies the parameters of path and query to the request. INVALID_ARGUMENT, also for unknown parameters.
Status fill_request(const HttpRoute& route, std::string_view query, WireMessage& request);

}  // namespace lightmill
