// How often this program compares texts: what searches lists of names compares each name with many others.
#pragma once

#include <cstdint>
#include <optional>

namespace lightmill::test {

/// So far, by == and by <. Nothing under sanitizers, which have to see the comparisons themselves.
std::optional<std::uint64_t> text_comparisons();

}  // namespace lightmill::test
