// Helpers of all fuzzers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/check.h"
#include "common/base/status.h"

namespace lightmill {

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// An error must name its place.
inline void expect_placed(const Status& status, std::string_view beginning) {
  const std::string message = message_of(status);
  LM_CHECK(message.starts_with(beginning), "the error does not name its place: {}", message);
}

inline void expect_ok(const Status& status, std::string_view what) {
  LM_CHECK(status.ok(), "{}: {}", what, message_of(status));
}

}  // namespace lightmill
