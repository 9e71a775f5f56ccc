// Floating-point mode in which nodes are rendered. Their bits depend on it.
#pragma once

#include <xmmintrin.h>

namespace lightmill {

/// Round to nearest, keep denormals, mask exceptions. The destructor restores the caller's mode.
class FixedFloatEnvironment {
 public:
  FixedFloatEnvironment() : saved_(_mm_getcsr()) { _mm_setcsr(0x1f80); }
  ~FixedFloatEnvironment() { _mm_setcsr(saved_); }
  FixedFloatEnvironment(const FixedFloatEnvironment&) = delete;
  FixedFloatEnvironment& operator=(const FixedFloatEnvironment&) = delete;

 private:
  unsigned saved_;
};

}  // namespace lightmill
