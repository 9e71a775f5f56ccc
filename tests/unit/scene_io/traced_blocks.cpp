// Work counted as blocks of code without a branch, in code compiled with -fsanitize-coverage=trace-pc.
#include <cstdlib>
#include <new>

#include "tests/unit/scene_io/work_done.h"

namespace {
std::uint64_t blocks = 0, allocated = 0;
}  // namespace

void* operator new(std::size_t size) {
  allocated += size;
  if (void* const out = std::malloc(size == 0 ? 1 : size)) {
    return out;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

/// Called at the beginning of each block.
extern "C" void __sanitizer_cov_trace_pc() {
  ++blocks;
}

namespace lightmill::test {
const int kManyNames = 50'000;  // with fewer names the linear work for each name dominates
std::optional<std::uint64_t> work_done() {
  return blocks;
}
std::optional<std::uint64_t> bytes_allocated() {
  return allocated;
}
}  // namespace lightmill::test
