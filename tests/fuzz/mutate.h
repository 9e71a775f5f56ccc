// Seeded mutation of inputs for parsers.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace lightmill {

/// SplitMix64 (Steele, Lea and Flood 2014), with the same numbers on every machine.
class FuzzRandom {
 public:
  explicit FuzzRandom(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  /// From 0 to `limit` − 1, for limits far below 2^64; `limit` must not be 0.
  std::size_t below(std::size_t limit) { return static_cast<std::size_t>(next() % limit); }

 private:
  std::uint64_t state_;
};

/// Number of damaged inputs of a test: `usual`, or LIGHTMILL_FUZZ_CASES if that is more.
int fuzz_cases(int usual);

/// Copy of `original` after one to eight random edits: bytes changed, removed, repeated, moved or cut off, or words
/// inserted.
std::string mutate(std::string_view original, std::span<const std::string_view> words, FuzzRandom& random);

}  // namespace lightmill
