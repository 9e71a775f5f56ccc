// Counter of the work that this program has done, in a unit that does not depend on the machine.
#pragma once

#include <cstdint>
#include <optional>

namespace lightmill::test {

/// Work so far: comparisons of texts (text_comparisons.cpp) or blocks of code (traced_blocks.cpp). Empty where
/// sanitizers have to see the comparisons themselves.
std::optional<std::uint64_t> work_done();

/// Bytes that operator new has returned so far. Empty where work is counted as comparisons.
std::optional<std::uint64_t> bytes_allocated();

/// With this many names, work_done() shows whether lists of names are searched.
extern const int kManyNames;

}  // namespace lightmill::test
