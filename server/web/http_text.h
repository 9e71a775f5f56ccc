// Requests and replies of the JSON API as text.
#pragma once

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
  SharedBytes file = nullptr;   ///< replaces the body, if given
  std::string set_cookie = {};  ///< value of the header Set-Cookie; empty: none
  std::string file_name = {};   ///< name for a download; empty: browsers show the body
};

/// {"error": {"code": "NOT_FOUND", "message": "…"}} with the HTTP status of the code.
ApiReply error_reply(const Status& status);
/// Protobuf's JSON, with original field names.
ApiReply json_reply(const google::protobuf::Message& message);
/// Parses the JSON of a body into `message`. An empty body changes nothing. INVALID_ARGUMENT.
Status read_json(const std::string& body, google::protobuf::Message& message);

/// The value of a field of the query. Empty if there is none.
std::string_view query_value(std::string_view query, std::string_view name);
/// INVALID_ARGUMENT if the percent-encoding is invalid.
Result<std::string> percent_decoded(std::string_view text);

}  // namespace lightmill
