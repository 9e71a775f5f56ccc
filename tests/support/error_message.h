// The error of a result as text, for comparisons in tests.
#pragma once

#include <string>

#include "common/base/status.h"

namespace lightmill::test {

/// The message, or "no error".
inline std::string error_message(const Status& status) {
  return status.ok() ? "no error" : message_of(status);
}
template <class T>
std::string error_message(const Result<T>& result) {
  return error_message(result.status());
}

}  // namespace lightmill::test
