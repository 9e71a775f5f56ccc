// Checks that two methods show the same picture of a scene.
//
// The check compares 48 block means and the means of the whole picture, from 16 seeds each. Standard errors come from
// the spread over seeds, so |z| follows Student's distribution with about 30 degrees of freedom. Above 6 anywhere in a
// scene is a false alarm once in 10,000 runs. Above 5 for a whole picture is one once in 16,000. The seeds are fixed, so
// a run that passes stays so.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {

inline constexpr int kFilm = 32, kBlocks = 4, kSeeds = 16;

/// Means by seed: blocks, then the whole picture; channels innermost.
inline std::vector<std::vector<double>> pictures(const TestScene& scene, const std::string& method,
                                                 std::uint32_t bounces) {
  std::vector<std::vector<double>> out;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const HalfImages image = scene.render({method, 300 + seed, bounces}, 4);
    EXPECT_EQ(image.non_finite, 0u);
    std::vector<double>& means = out.emplace_back(3 * (kBlocks * kBlocks + 1), 0.0);
    constexpr int kSide = kFilm / kBlocks;
    for (int y = 0; y < kFilm; ++y) {
      for (int x = 0; x < kFilm; ++x) {
        for (int c = 0; c < 3; ++c) {
          const double value = image.mean((y * kFilm + x) * 3 + c);
          means[3 * (y / kSide * kBlocks + x / kSide) + c] += value / (kSide * kSide);
          means[3 * kBlocks * kBlocks + c] += value / (kFilm * kFilm);
        }
      }
    }
  }
  return out;
}

inline Estimate estimate(const std::vector<std::vector<double>>& seeds, std::size_t i) {
  double sum = 0, squares = 0;
  for (const auto& seed : seeds) {
    sum += seed[i] / kSeeds;
  }
  for (const auto& seed : seeds) {
    squares += (seed[i] - sum) * (seed[i] - sum);
  }
  return {sum, std::sqrt(squares / (kSeeds - 1) / kSeeds)};
}

/// The two methods, and how closely their pictures must agree.
struct Same {
  std::string method = "caustic", reference = "path";
  double precision = 0.01;  ///< limit of the whole picture's standard error, as a share of its mean
  std::uint32_t bounces = 0;
  double blur = 0;  ///< allowed bias of a method, as a share of any mean
};

inline void expect_same(const TestScene& scene, const Same& how) {
  const auto a = pictures(scene, how.reference, how.bounces), b = pictures(scene, how.method, how.bounces);
  for (std::size_t i = 0; i < a.front().size(); ++i) {
    const Estimate p = estimate(a, i), c = estimate(b, i);
    const bool whole = i >= 3 * kBlocks * kBlocks;
    const double error = std::hypot(p.standard_error, c.standard_error);
    EXPECT_NEAR(c.value, p.value, (whole ? 5 : 6) * error + (how.blur + 1e-4) * p.value)
        << (whole ? "whole" : "block") << ' ' << i / 3 << " channel " << i % 3;
    if (whole) {
      EXPECT_LT(error, how.precision * p.value) << "the noise hides a difference";
      if (std::getenv("LIGHTMILL_SHOW") != nullptr) {
        fmt::print("{:.5f} ± {:.5f}, {:.5f} ± {:.5f}\n", p.value, p.standard_error, c.value, c.standard_error);
      }
    }
  }
}

}  // namespace lightmill::test
