// What requests and answers may hold together: beyond that they are refused.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/web/change_log.h"

namespace lightmill {

/// Copies share what there is. Thread-safe.
class ByteBudget {
 public:
  /// A share of it, given back with its last copy.
  using Place = std::shared_ptr<const void>;

  explicit ByteBudget(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  /// Null if there is not so much left.
  Place take(std::uint64_t bytes) const {
    if (taken_->fetch_add(bytes) + bytes > most_bytes_) {
      *taken_ -= bytes;
      return nullptr;
    }
    return {taken_.get(), [taken = taken_, bytes](const void*) { *taken -= bytes; }};
  }
  /// So many bytes more than `before`; null, and `before` is kept, if they are not left.
  Place take_more(const Place& before, std::uint64_t bytes) const {
    const Place more = take(bytes);
    return more == nullptr ? nullptr : std::make_shared<const std::pair<Place, Place>>(before, more);
  }

 private:
  std::uint64_t most_bytes_;
  std::shared_ptr<std::atomic<std::uint64_t>> taken_ = std::make_shared<std::atomic<std::uint64_t>>(0);
};

/// The bytes, with their place until nobody holds them any more.
inline SharedBytes placed_bytes(std::string bytes, ByteBudget::Place place) {
  const auto placed =
      std::make_shared<const std::pair<std::string, ByteBudget::Place>>(std::move(bytes), std::move(place));
  return {placed, &placed->first};
}

}  // namespace lightmill
