// The loop of fuzz tests.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <vector>

#include "tests/fuzz/mutate.h"

namespace lightmill {

/// Damages a copy of an original, and reads it. Returns whether the copy was accepted; nothing if it does not count.
using FuzzRead = std::function<std::optional<bool>(const std::string& original, FuzzRandom& random)>;

/// Reads this many damaged originals. Fails the test unless more than `least_accepted` of them are accepted, and more
/// than 1 % refused: otherwise the damage is too small or too large to test anything.
inline void expect_both_outcomes(const std::vector<std::string>& originals, std::uint64_t seed, int rounds,
                                 const FuzzRead& read, double least_accepted = 0.01) {
  FuzzRandom random(seed);
  int accepted = 0, refused = 0;
  for (int round = 0; round < rounds; ++round) {
    SCOPED_TRACE(round);
    const std::string& original = originals[originals.size() == 1 ? 0 : random.below(originals.size())];
    if (const std::optional<bool> answer = read(original, random)) {
      ++(*answer ? accepted : refused);
    }
  }
  EXPECT_GT(accepted, rounds * least_accepted);
  EXPECT_GT(refused, rounds * 0.01);
}

}  // namespace lightmill
