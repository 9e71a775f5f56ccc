#include "server/web/http_route.h"

#include <limits>

#include "common/base/check.h"
#include "common/base/text.h"
#include "server/web/http_text.h"

namespace lightmill {
namespace {

using google::protobuf::FieldDescriptor;

/// Removes the text up to `mark` and the mark from `text`, and returns what was before the mark. Without a mark it
/// takes everything.
std::string_view take_until(std::string_view& text, std::string_view mark) {
  const std::string_view before = text.substr(0, text.find(mark));
  text.remove_prefix(std::min(text.size(), before.size() + mark.size()));
  return before;
}

const FieldDescriptor& field_of(const Operation& operation, std::string_view name) {
  const FieldDescriptor* const field = operation.handler.request->GetDescriptor()->FindFieldByName(std::string(name));
  LM_CHECK(field != nullptr, "{} has no field {}", operation.http, name);
  return *field;
}

/// The route of the operation, if the path matches.
std::optional<HttpRoute> route_of(const Operation& operation, std::string_view path) {
  std::string_view form = operation.http;
  HttpRoute route{&operation, take_until(form, " ") == "POST", "", "", ""};
  std::string_view after = take_until(form, "?");
  route.query = form;
  const std::string_view before = take_until(after, "{");
  route.field = take_until(after, "}");
  if (route.field.empty()) {
    return path == before ? std::optional(route) : std::nullopt;
  }
  if (path.size() < before.size() + after.size() || !path.starts_with(before) || !path.ends_with(after)) {
    return std::nullopt;
  }
  route.value = path.substr(before.size(), path.size() - before.size() - after.size());
  const bool is_text = field_of(operation, route.field).cpp_type() == FieldDescriptor::CPPTYPE_STRING;
  return is_text || parse_number<std::uint64_t>(route.value) ? std::optional(route) : std::nullopt;
}

/// A number in `range`, such as "1..1000". Empty: any number.
template <class Number>
Result<Number> number_of(std::string_view name, std::string_view text, std::string_view range) {
  const Number least =
      range.empty() ? std::numeric_limits<Number>::min() : *parse_number<Number>(take_until(range, ".."));
  const Number most = range.empty() ? std::numeric_limits<Number>::max() : *parse_number<Number>(range);
  const std::optional<Number> number = parse_number<Number>(text);
  return number && *number >= least && *number <= most
             ? Result<Number>(*number)
             : invalid_argument("{} must be a number from {} to {}, got '{}'", name, least, most, printable(text));
}

Status set_field(const FieldDescriptor& field, std::string_view text, std::string_view range, WireMessage& request) {
  const google::protobuf::Reflection& reflection = *request.GetReflection();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
    LM_ASSIGN_OR_RETURN(std::string decoded, percent_decoded(text));
    reflection.SetString(&request, &field, std::move(decoded));
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_UINT64) {
    LM_ASSIGN_OR_RETURN(const std::uint64_t number, number_of<std::uint64_t>(field.name(), text, range));
    reflection.SetUInt64(&request, &field, number);
  } else {
    LM_ASSIGN_OR_RETURN(const std::int32_t number, number_of<std::int32_t>(field.name(), text, range));
    reflection.SetInt32(&request, &field, number);
  }
  return ok_status();
}

/// The range of a parameter of the query, e.g. "1..1000", or empty. INVALID_ARGUMENT if the path does not have it.
Result<std::string_view> range_of(const HttpRoute& route, std::string_view name) {
  std::vector<std::string_view> known;
  for (std::string_view fields = route.operation->rpc.method == "SubmitJob" ? kPageParameter : route.query;
       !fields.empty();) {
    std::string_view range = take_until(fields, "&");
    known.push_back(take_until(range, "="));
    if (known.back() == name) {
      return range;
    }
  }
  return invalid_argument(
      "the query has an unknown parameter '{}'. {}", printable(name),
      known.empty() ? "This path has none" : fmt::format("This path has {}", fmt::join(known, ", ")));
}

}  // namespace

std::optional<HttpRoute> find_route(std::string_view path, bool post) {
  std::optional<HttpRoute> found;
  for (const Operation& operation : operations()) {
    if (found && found->post == post) {
      break;
    }
    if (const std::optional<HttpRoute> route = route_of(operation, path)) {
      found = route;
    }
  }
  return found;
}

Status fill_request(const HttpRoute& route, std::string_view query, WireMessage& request) {
  if (!route.field.empty()) {
    LM_RETURN_IF_ERROR(set_field(field_of(*route.operation, route.field), route.value, "", request));
  }
  while (!query.empty()) {
    std::string_view value = take_until(query, "&");
    const std::string_view name = take_until(value, "=");
    LM_ASSIGN_OR_RETURN(const std::string_view range, range_of(route, name));
    if (!value.empty() && name != kPageParameter) {
      LM_RETURN_IF_ERROR(set_field(field_of(*route.operation, name), value, range, request));
    }
  }
  return ok_status();
}

}  // namespace lightmill
