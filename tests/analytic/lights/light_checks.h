// Helpers for tests of light sampling: independent draws, lanes, and counts over a grid.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/lights/light_table.h"
#include "tests/support/chi_squared.h"
#include "tests/support/lanes.h"

namespace lightmill::test {

inline constexpr int kDraws = 200'000;

/// Calls `draw(choice, u)` on independent random pairs, eight at a time.
template <class Draw>
void for_each_draw(std::uint32_t seed, Draw draw) {
  for (int i = 0; i < kDraws; i += 8) {
    const U8 index = U8(static_cast<std::uint32_t>(i)) + U8::lane_index();
    draw(hashed_pair(index, U8(mix(seed ^ 0x51a3u))), hashed_pair(index, U8(mix(seed))));
  }
}

inline const Pair8 kNoChoice{F8(0.0f), F8(0.0f)};

/// Lambertian white light of radiance 1.
inline const Vec3 kWhite{1, 1, 1};

}  // namespace lightmill::test
