// A global operator new that counts allocations, and lets one fail on request. Exactly one file of a program includes it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace lightmill::test {

inline std::atomic<std::uint64_t> allocations = 0;
/// Allocations until one fails; negative: none fails.
inline std::atomic<std::int64_t> allocations_left = -1;

}  // namespace lightmill::test

void* operator new(std::size_t bytes) {
  using namespace lightmill::test;
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (allocations_left.load(std::memory_order_relaxed) >= 0 && allocations_left.fetch_sub(1) == 0) {
    if (const std::new_handler handler = std::get_new_handler()) {
      handler();
    }
    throw std::bad_alloc();
  }
  if (void* const found = std::malloc(std::max<std::size_t>(bytes, 1))) {
    return found;
  }
  throw std::bad_alloc();
}
// Without this, AddressSanitizer would provide the operator, and report that the operators below free its memory.
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  try {
    return ::operator new(bytes);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
