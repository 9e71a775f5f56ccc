// Access to single lanes, for tests.
#pragma once

#include "common/math/simd.h"

namespace lightmill::test {

struct Lanes {
  alignas(32) float v[8];
  explicit Lanes(F8 x) { x.store(v); }
  double operator[](int i) const { return v[i]; }
};

}  // namespace lightmill::test
