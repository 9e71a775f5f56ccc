#include <gtest/gtest.h>

#include <cmath>

#include "common/math/exp_log.h"

namespace lightmill {
namespace {

double first(F8 x) {
  alignas(32) float lanes[8];
  x.store(lanes);
  return lanes[0];
}

TEST(ExpLog, ExpAgreesWithTheCLibrary) {
  for (int i = -873'000; i <= 883'000; i += 37) {
    const float x = static_cast<float>(i) * 1e-4f;
    const double exact = std::exp(static_cast<double>(x));
    ASSERT_NEAR(first(exp(F8(x))), exact, 2e-7 * exact) << x;
  }
  EXPECT_EQ(first(exp(F8(0.0f))), 1);
  EXPECT_EQ(first(exp(F8(-88.0f))), 0);
  EXPECT_EQ(first(exp(F8(-std::numeric_limits<float>::infinity()))), 0);
  EXPECT_NEAR(first(exp(F8(1e9f))), std::exp(88.3), 1e-5 * std::exp(88.3));
}

TEST(ExpLog, ExpMinusOneKeepsSmallNumbers) {
  for (int i = 0; i < 60'000; ++i) {
    const float size = std::ldexp(1.0f + static_cast<float>(i % 97) / 97, -40 + i % 46);
    for (const float x : {size, -size}) {
      if (x > -80) {
        const double exact = std::expm1(static_cast<double>(x));
        ASSERT_NEAR(first(expm1(F8(x))), exact, 4e-7 * std::abs(exact)) << x;
      }
    }
  }
  EXPECT_EQ(first(expm1(F8(0.0f))), 0);
  EXPECT_EQ(first(expm1(F8(-1e9f))), -1);
}

TEST(ExpLog, LogAgreesWithTheCLibrary) {
  for (int i = 0; i < 250'000; ++i) {
    const float x = std::ldexp(1.0f + static_cast<float>(i % 1009) / 1009, -126 + i % 253);
    const double exact = std::log(static_cast<double>(x));
    ASSERT_NEAR(first(log(F8(x))), exact, 2e-7 * std::abs(exact)) << x;
  }
  EXPECT_EQ(first(log(F8(1.0f))), 0);
  EXPECT_NEAR(first(log(F8(0.0f))), -126 * std::log(2.0), 1e-4);
}

TEST(ExpLog, LogOfOnePlusKeepsSmallNumbers) {
  for (int i = 0; i < 60'000; ++i) {
    const float size = std::ldexp(1.0f + static_cast<float>(i % 97) / 97, -40 + i % 60);
    for (const float y : {size, -size}) {
      if (y > -1) {
        const double exact = std::log1p(static_cast<double>(y));
        ASSERT_NEAR(first(log1p(F8(y))), exact, 4e-7 * std::abs(exact)) << y;
      }
    }
  }
}

TEST(ExpLog, PowersOfNumbersNearOneAreAccurate) {
  for (const float exponent : {0.0f, 1.0f, 42.0f, 1e3f, 1e6f}) {
    for (const float h : {0.0f, 1e-9f, 1e-7f, 1e-6f, 3e-6f, 1e-3f, 0.3f, 0.9f}) {
      const double log_exact = exponent * std::log1p(-static_cast<double>(h));
      const double exact = std::exp(log_exact);
      EXPECT_NEAR(first(pow_one_minus(F8(h), F8(exponent))), exact, 6e-7 * (1 + std::abs(log_exact)) * exact + 1e-37)
          << exponent << " " << h;
    }
  }
  EXPECT_EQ(first(pow_one_minus(F8(1.0f), F8(0.0f))), 1);
  EXPECT_LT(first(pow_one_minus(F8(1.0f), F8(1.0f))), 1e-37);
}

TEST(ExpLog, PowersAgreeWithTheCLibrary) {
  for (const double n : {0.0, 0.5, 1.0, 2.0, 42.0, 1e4}) {
    for (int i = 1; i <= 1200; ++i) {
      const auto x = static_cast<float>(i * 0.001);
      const double exact = std::pow(static_cast<double>(x), n);
      if (exact > 1e-37 && exact < 1e37) {
        ASSERT_NEAR(first(pow(F8(x), F8(static_cast<float>(n)))), exact, 3e-7 * (1 + std::abs(std::log(exact))) * exact)
            << x << " ^ " << n;
      }
    }
    EXPECT_EQ(first(pow(F8(0.0f), F8(static_cast<float>(n)))), n == 0 ? 1 : 0);
  }
}

}  // namespace
}  // namespace lightmill
