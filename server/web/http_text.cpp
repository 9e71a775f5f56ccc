#include "server/web/http_text.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>

#include "common/base/text.h"

namespace lightmill {
namespace {

unsigned http_status(StatusCode code) {
  switch (code) {
    case StatusCode::kInvalidArgument:
    case StatusCode::kOutOfRange:
      return 400;
    case StatusCode::kUnauthenticated:
      return 401;
    case StatusCode::kPermissionDenied:
      return 403;
    case StatusCode::kNotFound:
      return 404;
    case StatusCode::kUnimplemented:
      return 405;
    case StatusCode::kFailedPrecondition:
    case StatusCode::kAlreadyExists:
      return 409;
    case StatusCode::kResourceExhausted:
    case StatusCode::kUnavailable:
    case StatusCode::kDeadlineExceeded:
      return 503;
    default:
      return 500;
  }
}

}  // namespace

ApiReply json_reply(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  options.add_whitespace = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  return status.ok() ? ApiReply{200, "application/json", std::move(text)}
                     : error_reply(internal_error("{}", status.ToString()));
}

ApiReply error_reply(const Status& status) {
  constexpr std::size_t kMaxBytes = 4000;  // it may quote what the caller sent
  return {http_status(status.code()), "application/json",
          fmt::format("{{\"error\": {{\"code\": \"{}\", \"message\": {}}}}}\n", absl::StatusCodeToString(status.code()),
                      json_text(cut_text(printable(message_of(status), true), kMaxBytes)))};
}

Status read_json(const std::string& body, google::protobuf::Message& message) {
  if (body.empty()) {
    return ok_status();
  }
  const auto status = google::protobuf::util::JsonStringToMessage(body, &message);
  return status.ok() ? ok_status() : invalid_argument("the body: {}", printable(std::string(status.message())));
}

std::string_view query_value(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    const std::string_view field = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), field.size() + 1));
    if (field.size() > name.size() && field.starts_with(name) && field[name.size()] == '=') {
      return field.substr(name.size() + 1);
    }
  }
  return {};
}

Result<std::string> percent_decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out.push_back(text[i]);
      continue;
    }
    unsigned char byte = 0;
    const std::string_view hex = text.substr(i + 1, 2);
    const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), byte, 16);
    if (hex.size() != 2 || error != std::errc() || end != hex.data() + 2) {
      return invalid_argument("'{}' is not percent-encoded", printable(text));
    }
    out.push_back(static_cast<char>(byte));
    i += 2;
  }
  return out;
}

}  // namespace lightmill
