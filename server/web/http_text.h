// Requests and answers of the JSON API as text.
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "server/web/change_log.h"

namespace google::protobuf {
class Message;
}

namespace lightmill {

struct ApiReply {
  unsigned status = 200;
  std::string content_type;
  std::string body;
  SharedBytes file = nullptr;   ///< in place of the body, if given
  std::string set_cookie = {};  ///< the header of that name; empty: none
  std::string file_name = {};   ///< under which browsers keep the body; empty: they show it
};

/// {"error": {"code": "NOT_FOUND", "message": "…"}} with the HTTP status that belongs to the code.
ApiReply error_reply(const Status& status);
/// In protobuf's JSON form, with the fields' own names.
ApiReply json_reply(const google::protobuf::Message& message);
/// Fills `message` with the JSON of a body; an empty body leaves it as it is. INVALID_ARGUMENT.
Status read_json(const std::string& body, google::protobuf::Message& message);

/// All of it, or nothing.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return !text.empty() && error == std::errc() && end == text.data() + text.size() ? std::optional(number)
                                                                                   : std::nullopt;
}

/// The value of a query's field; empty if there is none.
std::string_view query_value(std::string_view query, std::string_view name);
/// INVALID_ARGUMENT for what is no percent-encoding.
Result<std::string> percent_decoded(std::string_view text);

}  // namespace lightmill
