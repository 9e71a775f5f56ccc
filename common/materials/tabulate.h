// Helpers of programs that print tables as C++.
#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "common/math/simd.h"

namespace lightmill {

/// A node's coordinate in [0, 1].
inline float node(int i, int nodes) {
  return static_cast<float>(i) / static_cast<float>(nodes - 1);
}

inline float first_of(F8 x) {
  alignas(32) float lanes[8];
  x.store(lanes);
  return lanes[0];
}

inline float sum_of(F8 x) {
  alignas(32) float lanes[8];
  x.store(lanes);
  float sum = 0;
  for (const float lane : lanes) {
    sum += lane;
  }
  return sum;
}

/// A table as C++.
inline std::string array(const char* name, const std::vector<float>& values) {
  std::string text = fmt::format("constexpr float {}[{}] = {{", name, values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += fmt::format("{}{:.8e}f,", i % 8 == 0 ? "\n" : "", values[i]);
  }
  return text + "};\n";
}

}  // namespace lightmill
