// Aborts at once. Tests that a fuzzer's finding is a failure.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t*, std::size_t) {
  std::abort();
}
