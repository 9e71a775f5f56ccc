// The processor's floating-point mode while a node is rendered: part of what fixes its bits.
#pragma once

#include <xmmintrin.h>

namespace lightmill {

/// Round to nearest, denormals kept, exceptions masked; the caller's mode comes back at the end of the scope.
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
