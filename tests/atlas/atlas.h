// Helpers that the tests of the failure atlas share.
#pragma once

#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {

/// A view of the scene's middle from above.
inline const char* const kAbove = R"("eye": [0.1, 0.5, 0.3], "look_at": [0, 0, 0])";

inline std::string sky(double radiance) {
  return fmt::format(R"({{"environment": {{"radiance": {}}}}})", gray(radiance));
}

/// A picture without NaN or infinite samples.
inline HalfImages clean_picture(const TestScene& scene, const std::string& method, std::uint32_t level,
                                std::uint32_t max_bounces = 0) {
  HalfImages image = scene.render({method, 70, max_bounces}, level);
  EXPECT_EQ(image.non_finite, 0u) << method;
  return image;
}

/// Every value of the picture is `exact`, except for a share of at most `strays`.
inline void expect_even(const HalfImages& image, double exact, double tolerance, double strays = 0) {
  std::size_t off = 0;
  double worst = exact;
  for (const auto* half : {&image.a, &image.b}) {
    for (const double value : *half) {
      if (!(std::abs(value - exact) <= tolerance)) {
        ++off;
        worst = std::abs(value - exact) > std::abs(worst - exact) ? value : worst;
      }
    }
  }
  EXPECT_LE(static_cast<double>(off), strays * 2 * static_cast<double>(image.a.size()))
      << off << " values are off, such as " << worst;
}

}  // namespace lightmill::test
