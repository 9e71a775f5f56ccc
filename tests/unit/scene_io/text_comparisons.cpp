// Work counted as comparisons of texts. A search of a list of names compares each name with many others.
#include "tests/unit/scene_io/work_done.h"

#include <atomic>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

namespace lightmill::test {
const int kManyNames = 0;
std::optional<std::uint64_t> work_done() {
  return std::nullopt;
}
std::optional<std::uint64_t> bytes_allocated() {
  return std::nullopt;
}
}  // namespace lightmill::test

#else

namespace {
std::atomic<std::uint64_t> comparisons = 0;
}  // namespace

/// Replaces the C library's memcmp in the whole program. std::string and std::string_view compare by it.
extern "C" int memcmp(const void* left, const void* right, std::size_t size) noexcept {
  comparisons.fetch_add(1, std::memory_order_relaxed);
  const auto* const a = static_cast<const unsigned char*>(left);
  const auto* const b = static_cast<const unsigned char*>(right);
  for (std::size_t i = 0; i < size; ++i) {
    if (a[i] != b[i]) {
      return a[i] < b[i] ? -1 : 1;
    }
  }
  return 0;
}

namespace lightmill::test {
const int kManyNames = 4'000;
std::optional<std::uint64_t> work_done() {
  return comparisons.load(std::memory_order_relaxed);
}
std::optional<std::uint64_t> bytes_allocated() {
  return std::nullopt;
}
}  // namespace lightmill::test

#endif
