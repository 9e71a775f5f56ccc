// Work counted as blocks of code without a branch, in code compiled with -fsanitize-coverage=trace-pc.
#include "tests/unit/scene_io/work_done.h"

namespace {
std::uint64_t blocks = 0;
}  // namespace

/// Called at the beginning of each block.
extern "C" void __sanitizer_cov_trace_pc() {
  ++blocks;
}

namespace lightmill::test {
const int kManyNames = 50'000;  // with fewer names the linear work for each name dominates
std::optional<std::uint64_t> work_done() {
  return blocks;
}
}  // namespace lightmill::test
