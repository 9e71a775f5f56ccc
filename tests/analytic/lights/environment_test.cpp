// Environments: directions follow the stated density, and directions map to the right pixels.
// The threshold of 5 standard deviations raises a false alarm once in 3.5 million tests.
#include "common/lights/environment_light.h"

#include <random>
#include <tuple>

#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

struct TestImage {
  std::size_t width, height;
  std::vector<float> rgb;
  TestImage(std::size_t w, std::size_t h, float value = 0) : width(w), height(h), rgb(3 * w * h, value) {}
  void set(std::size_t x, std::size_t y, const Vec3& value) {
    std::copy_n(&value.x, 3, rgb.begin() + static_cast<std::ptrdiff_t>(3 * (y * width + x)));
  }
  EnvironmentRadiance light(double rotation_degrees = 0, const Vec3& scale = Vec3(1)) const {
    return EnvironmentRadiance({.rgb = rgb, .width = width, .height = height, .rotation_degrees = rotation_degrees},
                               scale);
  }
  EnvironmentRadiance equal_area(const std::optional<std::array<Vec3d, 3>>& orientation = std::nullopt) const {
    return EnvironmentRadiance({.rgb = rgb,
                                .width = width,
                                .height = height,
                                .mapping = EnvironmentMapping::equal_area,
                                .orientation = orientation},
                               Vec3(1));
  }
};

/// Counts drawn directions over a grid of longitudes and latitudes, and compares with the integral of the stated
/// density.
double direction_z(std::uint32_t seed, const EnvironmentRadiance& light) {
  constexpr int kHeights = 24, kSectors = 24, kSub = 48;
  std::vector<double> counts(kHeights * kSectors), expected(kHeights * kSectors);
  for_each_draw(seed, [&](Pair8, Pair8 u) {
    const LightSample8 s = light.sample(broadcast(Vec3(0)), u);
    const VectorLanes wi(s.wi);
    const Lanes pdf(s.pdf_solid_angle), again(light.pdf_solid_angle(s.wi));
    for (int lane = 0; lane < 8; ++lane) {
      ASSERT_NEAR(glm::length(wi[lane]), 1, 1e-5);
      const double theta = std::acos(std::clamp(wi[lane].y, -1.0, 1.0));
      const int i = std::clamp(static_cast<int>(theta / M_PI * kHeights), 0, kHeights - 1);
      const double turn = std::atan2(wi[lane].z, wi[lane].x) / (2 * M_PI) + 0.5;
      const int j = std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1);
      counts[i * kSectors + j] += 1;
    }
  });
  for (int i = 0; i < kHeights * kSub; ++i) {
    for (int j = 0; j < kSectors * kSub; j += 8) {
      const double theta = M_PI * (i + 0.5) / (kHeights * kSub), y = std::cos(theta), r = std::sin(theta);
      alignas(32) float x[8], z[8];
      for (int lane = 0; lane < 8; ++lane) {
        const double phi = 2 * M_PI * ((j + lane + 0.5) / (kSectors * kSub) - 0.5);
        x[lane] = static_cast<float>(r * std::cos(phi));
        z[lane] = static_cast<float>(r * std::sin(phi));
      }
      const Lanes pdf(light.pdf_solid_angle({F8::load(x), F8(static_cast<float>(y)), F8::load(z)}));
      for (int lane = 0; lane < 8; ++lane) {
        expected[i / kSub * kSectors + (j + lane) / kSub] +=
            kDraws * pdf[lane] * 2 * M_PI * M_PI * r / (kHeights * kSub * kSectors * kSub);
      }
    }
  }
  return chi_squared_z(counts, expected);
}

// Beyond 2^23 columns a float cannot hold the middle of the last one.
TEST(PiecewiseConstant, FindsTheLastOfMillionsOfColumns) {
  constexpr std::size_t kColumns = (std::size_t{1} << 23) + 2;
  std::vector<double> weights(kColumns, 0.0);
  weights.back() = 1;
  const PiecewiseConstant2D density(weights, kColumns, 1);
  const Lanes last(density.pdf(F8(1.0f), F8(1.0f))), first(density.pdf(F8(0.0f), F8(0.0f)));
  EXPECT_EQ(last[0], static_cast<double>(kColumns));
  EXPECT_EQ(first[0], 0);
}

TEST(Environment, DirectionsFollowTheStatedDensity) {
  TestImage image(64, 32, 0.1f);
  for (std::size_t y = 0; y < 32; ++y) {
    for (std::size_t x = 0; x < 64; ++x) {
      image.set(x, y, Vec3(static_cast<float>(0.1 + std::pow(std::sin(0.2 * x) * std::cos(0.15 * y), 2))));
    }
  }
  image.set(0, 5, Vec3(9, 3, 1));    // at the seam
  image.set(63, 20, Vec3(2, 8, 1));  // and on its other side
  for (std::size_t x = 0; x < 64; ++x) {
    image.set(x, 0, Vec3(6));  // all around a pole
  }
  EXPECT_LT(direction_z(1, image.light()), kChiSquaredThreshold);
  // A whole number of the integral's steps, so that edges of pixels fall between steps.
  EXPECT_LT(direction_z(2, image.light(247 * 15.0 / 48)), kChiSquaredThreshold);
}

TEST(Environment, OddSizesAndSinglePixelsFollowTheStatedDensity) {
  TestImage odd(7, 3, 0.5f);
  odd.set(3, 1, Vec3(4));
  EXPECT_LT(direction_z(3, odd.light()), kChiSquaredThreshold);
  TestImage column(1, 2);
  column.set(0, 0, Vec3(1));
  EXPECT_LT(direction_z(4, column.light()), kChiSquaredThreshold);
}

TEST(Environment, ASampleHasTheDensityOfARayThatFindsIt) {
  TestImage image(32, 16, 0.2f);
  image.set(9, 4, Vec3(50));
  const EnvironmentRadiance light = image.light(30);
  int differ = 0;
  for_each_draw(5, [&](Pair8, Pair8 u) {
    const LightSample8 s = light.sample(broadcast(Vec3(1, 2, 3)), u);
    const Lanes drawn(s.pdf_solid_angle), found(light.pdf_solid_angle(s.wi)), weight(s.weight.x);
    const VectorLanes radiance(light.radiance(s.wi));
    for (int lane = 0; lane < 8; ++lane) {
      // Rounding can move a direction at the edge of a pixel into its neighbour.
      differ += std::abs(found[lane] / drawn[lane] - 1) > 1e-4 ? 1 : 0;
      ASSERT_NEAR(weight[lane] * drawn[lane], radiance[lane].x, 2e-3 * radiance[lane].x);
    }
  });
  EXPECT_LT(differ, kDraws / 1000);
}

TEST(Environment, ConstantsAreNotSampled) {
  EXPECT_FALSE(EnvironmentRadiance(Vec3(1, 2, 3)).samplable());
  EXPECT_FALSE(TestImage(16, 8, 0.7f).light().samplable());
  const VectorLanes radiance(EnvironmentRadiance(Vec3(1, 2, 3)).radiance(broadcast(Vec3(0, 1, 0))));
  EXPECT_EQ(radiance[3], Vec3d(1, 2, 3));
}

Vec3d seen(const EnvironmentRadiance& light, const Vec3& direction) {
  return VectorLanes(light.radiance(broadcast(glm::normalize(direction))))[0];
}

TEST(Environment, TheMeanCountsRowsByTheirSolidAngle) {
  // The top row of four is the cap within 45° of the pole: (1 − cos 45°)/2 of all directions.
  TestImage image(8, 4);
  for (std::size_t x = 0; x < 8; ++x) {
    image.set(x, 0, {8, 2, 1});
  }
  const Vec3d mean = image.light(30, {1, 2, 0}).mean_radiance();
  EXPECT_NEAR(mean.x, 4 * (1 - std::sqrt(0.5)), 1e-6);
  EXPECT_NEAR(mean.y, 2 * (1 - std::sqrt(0.5)), 1e-6);
  EXPECT_EQ(mean.z, 0);
  EXPECT_EQ(EnvironmentRadiance({0.25f, 0.5f, 1}).mean_radiance(), Vec3d(0.25, 0.5, 1));
  EXPECT_EQ(EnvironmentRadiance().mean_radiance(), Vec3d(0));
}

TEST(Environment, EachPixelIsInItsDocumentedDirection) {
  // 8 × 4 pixels with the value 10 y + x.
  TestImage image(8, 4);
  for (std::size_t y = 0; y < 4; ++y) {
    for (std::size_t x = 0; x < 8; ++x) {
      image.set(x, y, Vec3(static_cast<float>(10 * y + x)));
    }
  }
  const EnvironmentRadiance light = image.light();
  const auto direction = [](double longitude_degrees, double latitude_degrees) {
    const double phi = longitude_degrees * M_PI / 180, theta = latitude_degrees * M_PI / 180;
    return Vec3(std::cos(theta) * std::cos(phi), std::sin(theta), std::cos(theta) * std::sin(phi));
  };
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) {
      // A pixel's centre. Column 4 begins at +x and continues towards +z.
      EXPECT_NEAR(seen(light, direction((x - 3.5) * 45, (1.5 - y) * 45)).x, 10 * y + x, 1e-4) << x << ' ' << y;
    }
  }
  EXPECT_NEAR(seen(light, {1, 0, 0}).x, 15 + 3.5, 1e-4);  // between four pixels
  EXPECT_NEAR(seen(light, {0, 0, 1}).x, 15 + 5.5, 1e-4);
  EXPECT_NEAR(seen(light, {0, 0, -1}).x, 15 + 1.5, 1e-4);
  EXPECT_NEAR(seen(light, {-1, 0, 1e-7f}).x, 15 + 3.5, 1e-4);  // across the seam: 7 and 0
  EXPECT_NEAR(seen(light, {-1, 0, -1e-7f}).x, 15 + 3.5, 1e-4);
  // Turned by 90° about +y. The pixel at +x is now at −z.
  EXPECT_NEAR(seen(image.light(90), {0, 0, -1}).x, 15 + 3.5, 1e-4);
  EXPECT_NEAR(seen(image.light(90), {1, 0, 0}).x, 15 + 5.5, 1e-4);
  // All columns meet at a pole. Any of them is right, but no NaN.
  for (const float y : {1.0f, -1.0f}) {
    const double value = seen(light, {0, y, 0}).x;
    EXPECT_GE(value, y > 0 ? 0 : 30);
    EXPECT_LE(value, y > 0 ? 7 : 37);
    EXPECT_TRUE(std::isfinite(Lanes(light.pdf_solid_angle(broadcast(Vec3(0, y, 0))))[0]));
  }
}

/// A square of equal areas whose values differ in all of its parts.
TestImage square(std::size_t side) {
  TestImage out(side, side);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      out.set(x, y,
              Vec3(static_cast<float>(0.1 + std::pow(std::sin(0.3 * x + 0.1) * std::cos(0.23 * y), 2)),
                   static_cast<float>(x), static_cast<float>(y)));
    }
  }
  return out;
}

TEST(EqualAreaEnvironment, EachPixelIsInItsDocumentedDirection) {
  const EnvironmentRadiance light = square(64).equal_area();
  const auto pixel = [&](const Vec3& direction) {
    const Vec3d value = seen(light, direction);
    return std::pair(value.y, value.z);
  };
  const float hair = 1e-3f;
  EXPECT_EQ(pixel({hair, hair, 1}), std::pair(32.0, 32.0));
  EXPECT_EQ(pixel({-hair, -hair, 1}), std::pair(31.0, 31.0));
  EXPECT_EQ(pixel({1, hair, hair}), std::pair(63.0, 32.0));
  EXPECT_EQ(pixel({-1, hair, hair}), std::pair(0.0, 32.0));
  EXPECT_EQ(pixel({hair, 1, hair}), std::pair(32.0, 63.0));
  EXPECT_EQ(pixel({hair, -1, hair}), std::pair(32.0, 0.0));
  EXPECT_EQ(pixel({hair, hair, -1}), std::pair(63.0, 63.0)) << "the corners are one direction";
  EXPECT_EQ(pixel({-hair, hair, -1}), std::pair(0.0, 63.0));
}

// Clarberg's definition, in double precision: rings around the pole of the area 1 − z are squares of the same area.
TEST(EqualAreaEnvironment, DirectionsAreMappedByTheDefinition) {
  const TestImage image = square(256);
  const EnvironmentRadiance light = image.equal_area();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  int near_an_edge = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double z = any(random), phi = M_PI * any(random), ring = std::sqrt(1 - z * z);
    const Vec3d d(ring * std::cos(phi), ring * std::sin(phi), z);
    const double r = std::sqrt(1 - std::abs(z)), octant = std::atan2(std::abs(d.y), std::abs(d.x)) / (M_PI / 2);
    double u = r * (1 - octant), v = r * octant;
    if (z < 0) {
      std::tie(u, v) = std::pair(1 - v, 1 - u);
    }
    const double x = (std::copysign(u, d.x) + 1) * 128, y = (std::copysign(v, d.y) + 1) * 128;
    const Vec3d value = VectorLanes(light.radiance(broadcast(Vec3(d))))[0];
    const bool same = value.y == std::floor(x) && value.z == std::floor(y);
    near_an_edge += same ? 0 : 1;
    ASSERT_TRUE(same || std::min(std::abs(x - std::round(x)), std::abs(y - std::round(y))) < 1e-3) << x << ' ' << y;
  }
  EXPECT_LT(near_an_edge, 100);
}

TEST(EqualAreaEnvironment, DirectionsFollowTheStatedDensity) {
  EXPECT_LT(direction_z(6, square(48).equal_area()), kChiSquaredThreshold);
  const Vec3d x = glm::normalize(Vec3d(1, 2, -1)), y = glm::normalize(glm::cross(x, Vec3d(0.3, 1, 0.2)));
  EXPECT_LT(direction_z(7, square(48).equal_area(std::array{x, y, glm::cross(y, x)})), kChiSquaredThreshold)
      << "turned and mirrored";
}

TEST(EqualAreaEnvironment, ASampleHasTheDensityAndRadianceOfARayThatFindsIt) {
  TestImage image = square(32);
  image.set(0, 0, Vec3(50));
  const Vec3d x = glm::normalize(Vec3d(1, 2, -1)), y = glm::normalize(glm::cross(x, Vec3d(0.3, 1, 0.2)));
  const EnvironmentRadiance light = image.equal_area(std::array{x, y, glm::cross(x, y)});
  int differ = 0;
  for_each_draw(8, [&](Pair8, Pair8 u) {
    const LightSample8 s = light.sample(broadcast(Vec3(1, 2, 3)), u);
    const Lanes drawn(s.pdf_solid_angle), found(light.pdf_solid_angle(s.wi)), weight(s.weight.x);
    const VectorLanes radiance(light.radiance(s.wi));
    for (int lane = 0; lane < 8; ++lane) {
      differ += std::abs(found[lane] / drawn[lane] - 1) > 1e-4 ||
                        std::abs(weight[lane] * drawn[lane] / radiance[lane].x - 1) > 1e-4
                    ? 1
                    : 0;
    }
  });
  EXPECT_LT(differ, kDraws / 1000);
}

TEST(EqualAreaEnvironment, TheMeanAndTheBeamsCountAllPixelsAlike) {
  const TestImage image = square(20);
  const EnvironmentRadiance light = image.equal_area();
  Vec3d mean(0);
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    mean += Vec3d(image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]) / 400.0;
  }
  EXPECT_NEAR(glm::length(light.mean_radiance() - mean), 0, 1e-9 * glm::length(mean));
  Vec3d flux(0);
  light.for_each_beam([&](const V8&, const V8& irradiance) {
    for (int lane = 0; lane < 8; ++lane) {
      flux += VectorLanes(irradiance)[lane];
    }
  });
  EXPECT_NEAR(glm::length(flux / (4 * M_PI) - mean), 0, 1e-5 * glm::length(mean));
}

TEST(Environment, AnOrientationIsTheTurnThatItSays) {
  TestImage image(16, 8);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    image.rgb[i] = static_cast<float>(i % 97);
  }
  // About y it is a rotation in degrees.
  const double turn = 35 * M_PI / 180;
  const EnvironmentRadiance turned({.rgb = image.rgb,
                                    .width = 16,
                                    .height = 8,
                                    .orientation = std::array{Vec3d(std::cos(turn), 0, -std::sin(turn)), Vec3d(0, 1, 0),
                                                              Vec3d(std::sin(turn), 0, std::cos(turn))},
                                    .rotation_degrees = 20},
                                   Vec3(1));
  const EnvironmentRadiance rotated = image.light(55), still = image.light();
  // Row by row: the scene's +z is the image's +x, +x is +y, and +y is +z.
  const EnvironmentRadiance cyclic({.rgb = image.rgb,
                                    .width = 16,
                                    .height = 8,
                                    .orientation = std::array{Vec3d(0, 0, 1), Vec3d(1, 0, 0), Vec3d(0, 1, 0)}},
                                   Vec3(1));
  for (const Vec3& d : {Vec3(1, 2, 3), Vec3(-2, 0.5f, 1), Vec3(0.1f, -3, -1)}) {
    EXPECT_NEAR(glm::length(seen(turned, d) - seen(rotated, d)), 0, 1e-3);
    EXPECT_NEAR(glm::length(seen(cyclic, d) - seen(still, {d.z, d.x, d.y})), 0, 1e-3);
  }
}

TEST(Environment, ANanDirectionStaysInTheImage) {
  TestImage image(3, 2, 0.5f);
  image.set(1, 1, Vec3(2));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec3& direction : {Vec3(nan, 0, 0), Vec3(0, nan, 0), Vec3(nan, nan, nan)}) {
    const double value = Lanes(image.light(20).radiance(broadcast(direction)).x)[3];
    EXPECT_GE(value, 0.5);
    EXPECT_LE(value, 2);
    EXPECT_LE(Lanes(square(4).equal_area().radiance(broadcast(direction)).x)[3], 1.1);
  }
}

}  // namespace
}  // namespace lightmill::test
