// The memory that a scene's decoded images may take together.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/status.h"

namespace lightmill {

class ImageBudget {
 public:
  explicit ImageBudget(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Counts an image; fails where all together exceed the limit, and names `where`.
  Status take(std::uint64_t bytes, const std::string& where) {
    bytes_ += bytes;
    return bytes_ <= max_bytes_
               ? ok_status()
               : resource_exhausted("{}: the scene's images need more than --images-gib {:.4g} of the worker allows",
                                    where, static_cast<double>(max_bytes_) / (1 << 30));
  }

 private:
  std::uint64_t max_bytes_;
  std::uint64_t bytes_ = 0;
};

}  // namespace lightmill
