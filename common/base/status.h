// Errors as values: `Status` and `Result<T>`, with gRPC's codes.
//
// Errors that the outside can cause are returned as one of these. The message names the offending value and its place.
// Errors that only a bug can cause are LM_CHECKs (check.h).
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace lightmill {

using Status = absl::Status;
using StatusCode = absl::StatusCode;
template <class T>
using Result = absl::StatusOr<T>;

inline Status ok_status() {
  return absl::OkStatus();
}

/// An error of any code with a formatted message.
template <class... Args>
Status make_error(StatusCode code, fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  return Status(code, absl::string_view(text.data(), text.size()));
}

#define LM_DEFINE_ERROR(name, code)                                           \
  template <class... Args>                                                    \
  Status name(fmt::format_string<Args...> format, Args&&... args) {           \
    return make_error(StatusCode::code, format, std::forward<Args>(args)...); \
  }
LM_DEFINE_ERROR(invalid_argument, kInvalidArgument)
LM_DEFINE_ERROR(not_found, kNotFound)
LM_DEFINE_ERROR(already_exists, kAlreadyExists)
LM_DEFINE_ERROR(failed_precondition, kFailedPrecondition)
LM_DEFINE_ERROR(resource_exhausted, kResourceExhausted)
LM_DEFINE_ERROR(unavailable, kUnavailable)
LM_DEFINE_ERROR(data_loss, kDataLoss)
LM_DEFINE_ERROR(internal_error, kInternal)
LM_DEFINE_ERROR(cancelled, kCancelled)
#undef LM_DEFINE_ERROR

/// The message without its code, as a std::string.
inline std::string message_of(const Status& status) {
  return std::string(status.message());
}

/// The same error with `context` put before its message, as in "scene.json: line 3: …".
inline Status with_context(const Status& status, std::string_view context) {
  if (status.ok()) {
    return status;
  }
  return make_error(status.code(), "{}: {}", context, message_of(status));
}
template <class T>
Result<T> with_context(Result<T> result, std::string_view context) {
  return result.ok() ? std::move(result) : Result<T>(with_context(result.status(), context));
}

}  // namespace lightmill

#define LM_CONCAT_INNER(a, b) a##b
#define LM_CONCAT(a, b) LM_CONCAT_INNER(a, b)

/// Returns from the enclosing function if `expression` is an error.
#define LM_RETURN_IF_ERROR(expression)                                   \
  do {                                                                   \
    if (::lightmill::Status lm_status = (expression); !lm_status.ok()) { \
      return lm_status;                                                  \
    }                                                                    \
  } while (false)

/// `LM_ASSIGN_OR_RETURN(auto x, f());` takes the value of a Result or returns its error.
#define LM_ASSIGN_OR_RETURN(declaration, expression) \
  LM_ASSIGN_OR_RETURN_INNER(LM_CONCAT(lm_result_, __LINE__), declaration, expression)
#define LM_ASSIGN_OR_RETURN_INNER(result, declaration, expression) \
  auto result = (expression);                                      \
  if (!result.ok()) {                                              \
    return result.status();                                        \
  }                                                                \
  declaration = std::move(*result)
