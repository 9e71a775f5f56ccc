// Lists come in pages; and what a farm says that has no time now.
#pragma once

#include <grpcpp/support/status.h>

#include <algorithm>

#include "common/base/status.h"

namespace lightmill {

inline constexpr int kMaxPage = 1'000;
inline constexpr int kDefaultPage = 100;

/// INVALID_ARGUMENT for a negative one.
inline Result<int> page_size_of(int asked) {
  if (asked < 0) {
    return invalid_argument("page_size must not be negative, got {}", asked);
  }
  return asked == 0 ? kDefaultPage : std::min(asked, kMaxPage);
}

inline grpc::Status busy() {
  return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "the farm has too much to do at once: try again");
}

}  // namespace lightmill
