// Memory limit for requests and replies together. Requests beyond it are refused.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "server/access/slot_pool.h"
#include "server/web/change_log.h"

namespace lightmill {

/// Copies share the same budget. Thread-safe.
class ByteBudget {
 public:
  /// A reservation. It ends with its last copy.
  using Reservation = std::shared_ptr<const void>;

  explicit ByteBudget(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  /// Null if fewer bytes are left.
  Reservation take(std::uint64_t bytes) const {
    if (taken_->fetch_add(bytes) + bytes > most_bytes_) {
      *taken_ -= bytes;
      return nullptr;
    }
    return {taken_.get(), [taken = taken_, bytes](const void*) { *taken -= bytes; }};
  }
  bool is_whole() const { return *taken_ == 0; }

 private:
  std::uint64_t most_bytes_;
  std::shared_ptr<std::atomic<std::uint64_t>> taken_ = std::make_shared<std::atomic<std::uint64_t>>(0);
};

/// A budget that gives one name, and one address, at most half of its bytes. Not thread-safe, but reservations may end
/// on any thread.
class CallersBudget {
 public:
  explicit CallersBudget(std::uint64_t most_bytes) : most_bytes_(most_bytes), all_(most_bytes) {}

  /// Reserves `bytes` in addition to `before`. Null if they are not left; then `before` stays.
  ByteBudget::Reservation take(const Holder& holder, std::uint64_t bytes,
                               const ByteBudget::Reservation& before = nullptr) {
    std::erase_if(halves_, [](const auto& entry) { return entry.second.is_whole(); });
    const ByteBudget::Reservation of_name = half_of("name " + holder.name).take(bytes);
    const ByteBudget::Reservation of_address = half_of("address " + holder.address).take(bytes);
    const ByteBudget::Reservation of_all = all_.take(bytes);
    return of_name == nullptr || of_address == nullptr || of_all == nullptr
               ? nullptr
               : std::make_shared<const std::array<ByteBudget::Reservation, 4>>(
                     std::array{before, of_name, of_address, of_all});
  }

 private:
  const ByteBudget& half_of(const std::string& who) { return halves_.try_emplace(who, most_bytes_ / 2).first->second; }

  const std::uint64_t most_bytes_;
  const ByteBudget all_;
  std::map<std::string, ByteBudget> halves_;  ///< of callers with reservations
};

/// Bytes that keep their reservation until their last user ends.
inline SharedBytes bytes_with_reservation(std::string bytes, ByteBudget::Reservation reservation) {
  const auto placed =
      std::make_shared<const std::pair<std::string, ByteBudget::Reservation>>(std::move(bytes), std::move(reservation));
  return {placed, &placed->first};
}

}  // namespace lightmill
