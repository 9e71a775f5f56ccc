// Points of next-event estimation on segments in fog: samples have the stated density, which integrates to 1.
#include "common/methods/tracer/inscattering.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/sampling/sobol.h"
#include "tests/support/chi_squared.h"
#include "tests/support/lanes.h"

namespace lightmill::tracer {
namespace {

using test::chi_squared_z;
using test::kChiSquaredThreshold;
using test::Lanes;

LightBounds ball(const Vec3d& center, double radius) {
  LightBounds b;
  b.low = center - radius;
  b.high = center + radius;
  b.power = b.intensity = 1;
  return b;
}
LightBounds cone(const Vec3d& apex, const Vec3d& axis, double cosine) {
  LightBounds b = ball(apex, 0);
  b.axis = glm::normalize(axis);
  b.cos_normals = 1;
  b.cos_emission = cosine;
  return b;
}
std::vector<LightBounds> row_of_balls(int count) {
  std::vector<LightBounds> lights;
  for (int i = 0; i < count; ++i) {
    lights.push_back(ball({0.3 * i - 3, i % 2 == 0 ? 1 : -0.5, 0.4}, 0.01 * (i % 3)));
  }
  return lights;
}

struct Segment {
  const char* name;
  std::vector<LightBounds> lights;
  Vec3 origin, direction;
  float length;
  Vec3 scattered, extinction;
};

constexpr float kEndless = std::numeric_limits<float>::infinity();

std::vector<Segment> segments() {
  const Vec3 x(1, 0, 0), gray(1);
  return {
      {"no light", {}, Vec3(0), x, 3, gray, gray},
      {"a point", {ball({1, 0.5, 0}, 0)}, Vec3(0), x, 3, gray, 0.1f * gray},
      {"a point close to the ray", {ball({1, 0.02, 0}, 0)}, Vec3(0), x, 3, gray, 0.1f * gray},
      {"a point behind", {ball({-2, 0.1, 0}, 0)}, Vec3(0), x, 3, gray, 0.1f * gray},
      {"a point beyond", {ball({5, 0.1, 0}, 0)}, Vec3(0), x, 3, gray, 0.1f * gray},
      {"endless", {ball({1, 0.5, 0}, 0)}, Vec3(0), x, kEndless, gray, 0.5f * gray},
      {"within a ball", {ball({1, 0, 0}, 2)}, Vec3(0), x, 3, gray, gray},
      {"coloured", {ball({1, 0.5, 0}, 0)}, Vec3(0), x, kEndless, {1, 0.2f, 0}, {5, 0.5f, 2}},
      {"a channel without fog", {ball({1, 0.5, 0}, 0)}, Vec3(0), x, 4, {1, 0, 0}, {1, 0, 0}},
      {"across a cone", {cone({1, 2, 0}, {0, -1, 0}, 0.9)}, Vec3(0), x, 3, gray, 0.1f * gray},
      {"along a cone", {cone({-1, 0.2, 0}, {1, 0, 0}, 0.9)}, Vec3(0), x, 3, gray, 0.1f * gray},
      {"towards a cone", {cone({3, 0.2, 0}, {-1, 0, 0}, 0.9)}, Vec3(0), x, 4, gray, 0.1f * gray},
      {"outside a cone", {cone({1, 2, 0}, {0, 1, 0}, 0.9)}, Vec3(0), x, 4, gray, 0.1f * gray},
      {"a half space", {cone({1, 1, 0}, {1, -0.1, 0}, 0)}, Vec3(0), x, 4, gray, 0.1f * gray},
      {"along a half space", {cone({1, 1, 0}, {0, -1, 0}, 0)}, Vec3(0), x, 4, gray, 0.1f * gray},
      {"a wide cone", {cone({1, 1, 0}, {0, 1, 0}, -0.5)}, Vec3(0), x, 4, gray, 0.1f * gray},
      {"lights and cones",
       {ball({1, 1, 0}, 0.1), cone({2, 1, 0}, {0, -1, 0}, 0.8), ball({-1, 1, 0}, 0)},
       Vec3(0),
       x,
       4,
       gray,
       0.3f * gray},
      {"many lights", row_of_balls(40), Vec3(-4, 0, 0), x, kEndless, gray, 0.2f * gray},
      {"far lights", row_of_balls(40), Vec3(-400, 30, 0), x, kEndless, gray, 3.0f * gray},
  };
}

/// With peaks that are narrower than the steps of a quadrature.
std::vector<Segment> peaks() {
  const Vec3 x(1, 0, 0), gray(1);
  return {{"a point on the ray", {ball({1, 0, 0}, 0)}, Vec3(0), x, 3, gray, 0.1f * gray},
          {"a point at the origin", {ball({0, 0, 0}, 0)}, Vec3(0), x, 3, gray, 0.1f * gray}};
}

InscatteringDensity8 density_of(const Segment& s) {
  return InscatteringDensity8(EquiangularLights(s.lights, {}), broadcast(s.origin), broadcast(s.direction),
                              F8(s.length), broadcast(s.scattered), broadcast(s.extinction));
}
double end_of(const Segment& s) {
  const double least = std::min({s.extinction.x, s.extinction.y, s.extinction.z});
  return std::min<double>(s.length, 30 / std::max(least, 0.1));
}

/// Integral of the density in single precision over [from, to].
double integral(const InscatteringDensity8& density, double from, double to) {
  constexpr int kSteps = 4000;
  double sum = 0;
  for (int i = 0; i < kSteps; i += 8) {
    alignas(32) float at[8];
    for (int lane = 0; lane < 8; ++lane) {
      at[lane] = static_cast<float>(from + (to - from) * (i + lane + 0.5) / kSteps);
    }
    const Lanes pdf(density.pdf_length(F8::load(at)));
    for (int lane = 0; lane < 8; ++lane) {
      sum += pdf[lane] * (to - from) / kSteps;
    }
  }
  return sum;
}

// 200,000 draws each. The threshold of 5 deviations raises a false alarm once in 3.5 million tests.
TEST(Inscattering, SamplesHaveTheStatedDensity) {
  constexpr int kDraws = 200'000, kCells = 60;
  for (const Segment& s : segments()) {
    const InscatteringDensity8 density = density_of(s);
    ASSERT_EQ(density.valid().bits(), 255) << s.name;
    // Cells grow with the distance.
    const double end = end_of(s);
    const auto edge = [&](int i) { return end * i * i / (kCells * kCells); };
    std::vector<double> counts(kCells + 1), expected(kCells + 1);
    for (int i = 0; i < kDraws; i += 8) {
      const Lanes at(density.sample(hashed_pair(U8(static_cast<std::uint32_t>(i)) + U8::lane_index(), U8(mix(7u)))));
      for (int lane = 0; lane < 8; ++lane) {
        ASSERT_GE(at[lane], 0) << s.name;
        ASSERT_LE(at[lane], s.length) << s.name;
        counts[std::min(static_cast<int>(std::sqrt(at[lane] / end) * kCells), kCells)] += 1;
      }
    }
    double sum = 0;
    for (int i = 0; i < kCells; ++i) {
      expected[i] = kDraws * integral(density, edge(i), edge(i + 1));
      sum += expected[i];
    }
    EXPECT_NEAR(sum / kDraws, 1, 1e-3) << s.name;
    expected[kCells] = std::max(kDraws - sum, 0.0);
    EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold) << s.name;
  }
}

// The mean of T/p over samples is the integral of transmittance, whatever lights there are, however dense the fog is.
TEST(Inscattering, WeightsAreFiniteAndSumToTheTransmittance) {
  std::vector<Segment> all = segments();
  std::ranges::move(peaks(), std::back_inserter(all));
  for (Segment s : all) {
    for (const float density : {1e-6f, 1e-3f, 1.0f, 1e3f}) {
      s.scattered = s.extinction = Vec3(density);
      const InscatteringDensity8 points = density_of(s);
      constexpr int kSide = 256;
      double sum = 0;
      for (int i = 0; i < kSide * kSide; i += 8) {
        const U8 index = U8(static_cast<std::uint32_t>(i)) + U8::lane_index();
        const F8 at = points.sample(sobol_pair(index, U8(5u)));
        const F8 half = points.pdf_length(at);
        const Lanes distance(at), pdf(half);
        for (int lane = 0; lane < 8; ++lane) {
          sum += std::exp(-double{density} * distance[lane]) / pdf[lane] / (kSide * kSide);
        }
      }
      const double exact = -std::expm1(-double{density} * s.length) / density;
      EXPECT_NEAR(sum, exact, 2e-3 * exact) << s.name << ", extinction " << density;
    }
  }
}

// Their light underflows at some density.
TEST(Inscattering, FarLightsInDenseFogLeaveAProbabilityForTransmittance) {
  const EquiangularLights lights(row_of_balls(3), {});
  for (float reach = 10; reach > 1e-4f; reach *= 0.998f) {
    const Lanes rest(lights.mixture(broadcast(Vec3(0, 0, 4)), broadcast(Vec3(0, 1, 0)), F8(5), F8(reach)).rest);
    ASSERT_GE(rest[0], 0.2 - 1e-6) << reach;
    ASSERT_LE(rest[0], 1) << reach;
  }
}

// The mean of f/p over samples is the integral of f over all directions, here of 1 + a·w + (b·w)².
TEST(Inscattering, DirectionsPastLightsHaveTheirDensity) {
  for (const auto& [name, lights] :
       {std::pair{"one", std::vector{ball({1, 2, 3}, 0)}},
        std::pair{"three", std::vector{ball({1, 2, 3}, 0.1), ball({-4, 0, 1}, 0), ball({0, 0, -0.1}, 0)}},
        std::pair{"many", row_of_balls(40)},
        std::pair{"within one", std::vector{ball({0, 0, 0}, 1), ball({3, 0, 0}, 0)}}}) {
    const EquiangularLights::Aim8 aim = EquiangularLights(lights, {}).aim(V8(), F8(2));
    const double rest = Lanes(aim.rest)[0];
    EXPECT_GE(rest, 0.7499) << name;
    EXPECT_LT(rest, 1) << name;
    const V8 a = broadcast(Vec3(0.3f, -0.2f, 0.5f)), b = broadcast(Vec3(1, 2, -0.5f));
    constexpr int kDraws = 65'536;
    double sum = 0;
    for (int i = 0; i < kDraws; i += 8) {
      const Pair8 u = sobol_pair(U8(static_cast<std::uint32_t>(i)) + U8::lane_index(), U8(9u));
      const V8 w = aim.sample({aim.rest + u.u * (F8(1) - aim.rest), u.v});
      const F8 along = dot(b, w), pdf = aim.pdf_solid_angle(w) / (F8(1) - aim.rest);
      const Lanes ratio((F8(1) + dot(a, w) + along * along) / pdf), length(length_squared(w));
      for (int lane = 0; lane < 8; ++lane) {
        ASSERT_NEAR(length[lane], 1, 1e-5) << name;
        sum += ratio[lane] / kDraws;
      }
    }
    const double exact = 4 * M_PI * (1 + (1 + 4 + 0.25) / 3);
    EXPECT_NEAR(sum, exact, 5e-3 * exact) << name;
  }
  EXPECT_EQ(Lanes(EquiangularLights().aim(V8(), F8(1)).rest)[0], 1) << "no lights";
}

// So the next segment, which gets light as 1 / sin θ, never gets much more than others.
TEST(Inscattering, TheAngleToALightIsUniform) {
  const EquiangularLights::Aim8 aim = EquiangularLights(std::vector{ball({0, 0, 3}, 0)}, {}).aim(V8(), F8(100));
  constexpr int kDraws = 4096, kCells = 16;
  std::array<int, kCells> counts{};
  for (int i = 0; i < kDraws; i += 8) {
    const Pair8 u = sobol_pair(U8(static_cast<std::uint32_t>(i)) + U8::lane_index(), U8(3u));
    const Lanes z(aim.sample({aim.rest + u.u * (F8(1) - aim.rest), u.v}).z);
    for (int lane = 0; lane < 8; ++lane) {
      ++counts.at(std::min(static_cast<int>(std::acos(std::clamp(z[lane], -1.0, 1.0)) / M_PI * kCells), kCells - 1));
    }
  }
  for (const int count : counts) {
    EXPECT_NEAR(count, kDraws / kCells, 3);
  }
}

TEST(Inscattering, SegmentsThatScatterNothingAreNotValid) {
  Segment s = segments()[1];
  s.scattered = Vec3(0);
  EXPECT_EQ(density_of(s).valid().bits(), 0);
  s.extinction = Vec3(0);
  EXPECT_EQ(density_of(s).valid().bits(), 0);
  s = segments()[1];
  s.length = 0;
  EXPECT_EQ(density_of(s).valid().bits(), 0);
}

TEST(Inscattering, TheNearestClusterIsKnown) {
  const EquiangularLights lights(std::vector{ball({3, 0, 0}, 1), ball({0, 10, 0}, 0)}, {});
  EXPECT_EQ(Lanes(lights.nearest2(broadcast(Vec3(3.5f, 0, 0))))[0], 0);
  EXPECT_EQ(Lanes(lights.nearest2(broadcast(Vec3(0, 6, 0))))[3], 16);
  EXPECT_EQ(Lanes(EquiangularLights().nearest2(V8()))[0], kEndless);
}

}  // namespace
}  // namespace lightmill::tracer
