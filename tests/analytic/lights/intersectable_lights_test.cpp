// Lights that rays can hit, although they are no surfaces. Samples follow the stated density. Rays meet what is sampled.
// The threshold of 5 standard deviations raises a false alarm once in 3.5 million tests.
#include <functional>

#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

/// Samples of the table's only light, seen from p, and directions around it that are uniform by solid angle, agree:
///   - the samples' distribution is that of the density over cells of direction, and the rest is unlit;
///   - a ray towards a sample meets the light there, with the sample's radiance and density.
/// `axis`: towards the light; `cos_around`: of a cone that contains it.
void expect_samples_follow_hits(LightTable table, const Vec3& p, const Vec3& axis, double cos_around) {
  table.build();
  ASSERT_EQ(table.intersectable().size(), 1u);
  constexpr int kCells = 12;
  const V8 from = broadcast(p);
  const Vec3 unit = glm::normalize(axis);
  const Frame8 frame(broadcast(unit));
  const auto cell_of = [&](const V8& direction, int lane) {
    const Vec3d d = VectorLanes(frame.to_local(direction))[lane];
    const double off_axis = (d.x * d.x + d.y * d.y) / (1 + d.z);  // 1 − cos, also of small angles
    const double height = off_axis / (1 - cos_around), turn = std::atan2(d.y, d.x) / (2 * M_PI) + 0.5;
    return std::clamp(static_cast<int>(height * kCells), 0, kCells - 1) * kCells +
           std::clamp(static_cast<int>(turn * kCells), 0, kCells - 1);
  };
  std::vector<double> counts(kCells * kCells), expected(kCells * kCells);
  int met = 0, drawn = 0;
  for_each_draw(1, [&](Pair8, Pair8 u) {
    const LightSample8 s = table.sample(from, 0, kNoChoice, u);
    const LightTable::LightHit8 there = table.meet(0, from, s.wi, s.valid);
    const Lanes stated(s.pdf_solid_angle), again(table.hit_pdf_solid_angle(0, from, s.wi, there, there.hit));
    const Lanes weight(s.weight.x), radiance(there.radiance.x);
    for (int lane = 0; lane < 8; ++lane) {
      if ((s.valid.bits() >> lane & 1) != 0) {
        ++drawn;
        counts[cell_of(s.wi, lane)] += 1;
        if ((there.hit.bits() >> lane & 1) != 0) {  // all but rays at the very edge
          ++met;
          ASSERT_NEAR(again[lane], stated[lane], 2e-3 * stated[lane]);
          ASSERT_NEAR(weight[lane] * stated[lane], radiance[lane], 2e-3 * radiance[lane]);
        }
      }
    }
  });
  EXPECT_GT(met, 0.999 * drawn);
  // The integral of the density over each cell, with a fine grid of directions.
  constexpr int kSub = 40, kSide = kCells * kSub;
  double integral = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; j += 8) {
      const F8 turn = (F8(static_cast<float>(j)) + to_float(U8::lane_index()) + F8(0.5f)) * F8(1.0f / kSide);
      const Pair8 u{F8((static_cast<float>(i) + 0.5f) / kSide), turn};
      const V8 direction = frame.to_world(square_to_cone(u, F8(static_cast<float>(1 - cos_around))));
      const LightTable::LightHit8 there = table.meet(0, from, direction, M8(true));
      const M8 lit = there.hit & (there.radiance.x > F8(0.0f));
      const Lanes pdf(masked(lit, table.hit_pdf_solid_angle(0, from, direction, there, lit)));
      for (int lane = 0; lane < 8; ++lane) {
        const double share = pdf[lane] * 2 * M_PI * (1 - cos_around) / (double{kSide} * kSide);
        integral += share;
        expected[cell_of(direction, lane)] += share * kDraws;
      }
    }
  }
  EXPECT_NEAR(integral, drawn / double{kDraws}, 0.01);
  counts.push_back(kDraws - drawn);  // samples without light
  expected.push_back(kDraws * std::max(1 - integral, 0.0));
  EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold);
}

float one_minus_cos(double degrees) {
  return static_cast<float>(1 - std::cos(degrees * M_PI / 180));
}

TEST(IntersectableLights, ASunsDiskIsSampledAsRaysMeetIt) {
  for (const double half : {0.26, 5.0, 60.0, 90.0}) {
    LightTable table;
    const Vec3 direction = glm::normalize(Vec3(0.3f, -1, 0.2f));
    table.directional.add({direction, {2, 3, 4}, one_minus_cos(half)});
    expect_samples_follow_hits(table, {1, 2, 3}, -direction, std::cos(half * M_PI / 180));
  }
}

TEST(IntersectableLights, ABallIsSampledAsRaysMeetIt) {
  for (const double distance : {1.001, 1.5, 20.0, 3000.0}) {
    LightTable table;
    const Vec3 towards = glm::normalize(Vec3(0.3f, -1, 0.2f)), p(0.1f, 0.2f, 0.3f);
    const float radius = 2;
    table.points.add({p + towards * static_cast<float>(distance * radius), {2, 3, 4}, radius});
    expect_samples_follow_hits(table, p, towards, std::sqrt(1 - 1 / (distance * distance)));
  }
}

TEST(IntersectableLights, ASpotsBallIsSampledAsRaysMeetIt) {
  // From the middle of its cone, where all directions are lit, and near its rim, where some are.
  for (const double degrees : {0.0, 25.0, 33.0}) {
    LightTable table;
    const Vec3 towards = glm::normalize(Vec3(0.3f, -1, 0.2f)), p(0.1f, 0.2f, 0.3f);
    const Vec3 aside = glm::normalize(glm::cross(towards, Vec3(1, 0, 0)));
    const auto turn = static_cast<float>(degrees * M_PI / 180);
    table.spots.add({p + towards * 5.0f,
                     -towards * std::cos(turn) + aside * std::sin(turn),
                     {2, 3, 4},
                     one_minus_cos(20),
                     one_minus_cos(30),
                     0.5f});
    expect_samples_follow_hits(table, p, towards, std::sqrt(0.99));
  }
}

TEST(IntersectableLights, ADiskIsSampledAsRaysMeetIt) {
  const Vec3 normal = glm::normalize(Vec3(0.3f, -1, 0.2f)), first = glm::normalize(glm::cross(normal, Vec3(1, 0, 0)));
  const Vec3 second = glm::cross(normal, first), center(0.5f, 2, 0.3f);
  for (const Vec3& p : {center + normal * 3.0f, center + normal * 0.5f + first, center + normal + second * 4.0f}) {
    LightTable table;
    table.disks.add({center, first * 0.8f, second * 0.8f, {2, 3, 4}});
    const double distance = glm::length(center - p);
    expect_samples_follow_hits(table, p, center - p, distance > 0.8 ? std::sqrt(1 - 0.64 / (distance * distance)) : 0);
  }
}

TEST(IntersectableLights, AnEllipseIsSampledAsRaysMeetIt) {
  LightTable table;
  table.disks.add({{0.5f, 2, 0.3f}, {0.9f, 0, 0}, {0, 0, 0.2f}, {2, 3, 4}});  // shines down
  expect_samples_follow_hits(table, {0.1f, 0.2f, 0.6f}, {0.4f, 1.8f, -0.3f}, std::cos(0.5));
}

TEST(IntersectableLights, ADiskWithASpreadIsSampledAsRaysMeetIt) {
  // From within the cone of every point, and from where only some of the disk shines.
  for (const float x : {0.1f, 2.2f}) {
    LightTable table;
    table.disks.add({{0, 2, 0}, {0.8f, 0, 0}, {0, 0, 0.8f}, {2, 3, 4}, M_PI / 2});  // shines down
    expect_samples_follow_hits(table, {x, 0.2f, 0}, {-x, 1.8f, 0}, std::cos(0.6));
  }
}

TEST(IntersectableLights, ARectangleIsSampledAsRaysMeetIt) {
  LightTable table;
  table.disks.add({{0.5f, 2, 0.3f}, {0.9f, 0, 0}, {0, 0, 0.2f}, {2, 3, 4}, M_PI, true});  // shines down
  expect_samples_follow_hits(table, {0.1f, 0.2f, 0.6f}, {0.4f, 1.8f, -0.3f}, std::cos(0.6));
}

TEST(IntersectableLights, ADiskIsDarkBehind) {
  LightTable table;
  table.disks.add({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 3, 4}});
  table.build();
  EXPECT_TRUE(table.sample(broadcast(Vec3(0, 0, -1)), 0, kNoChoice, {F8(0.3f), F8(0.6f)}).valid.none());
  EXPECT_TRUE(table.meet(0, broadcast(Vec3(0, 0, -1)), broadcast(Vec3(0, 0, 1)), M8(true)).hit.none());
  EXPECT_EQ(table.meet(0, broadcast(Vec3(0, 0, 1)), broadcast(Vec3(0, 0, -1)), M8(true)).hit.bits(), 255);
}

TEST(IntersectableLights, ABallIsDarkInside) {
  LightTable table;
  table.points.add({{0, 0, 0}, {2, 3, 4}, 2});
  table.build();
  EXPECT_TRUE(table.sample(broadcast(Vec3(0, 1, 0)), 0, kNoChoice, {F8(0.3f), F8(0.6f)}).valid.none());
  EXPECT_TRUE(table.meet(0, broadcast(Vec3(0, 1, 0)), broadcast(Vec3(0, 0, 1)), M8(true)).hit.none());
}

TEST(IntersectableLights, ABallThatShrinksBecomesAPoint) {
  // The mean of its samples is I/d² at any radius, and each sample is where single precision sees only a point.
  for (const float radius : {0.0f, 1e-9f, 1e-4f, 1e-2f}) {
    LightTable table;
    table.points.add({{0, 5, 0}, {50, 50, 50}, radius});
    table.build();
    for_each_draw(3, [&](Pair8, Pair8 u) {
      const Lanes weight(table.sample(broadcast(Vec3(0)), 0, kNoChoice, u).weight.x);
      ASSERT_NEAR(weight[0], 2, 1e-5);
    });
  }
}

TEST(IntersectableLights, LightsWithoutASizeAreNoBodies) {
  LightTable table;
  table.directional.add({{0, -1, 0}, {2, 3, 4}});
  table.points.add({{0, 1, 0}, Vec3(1)});
  table.build();
  EXPECT_TRUE(table.intersectable().empty());
}

}  // namespace
}  // namespace lightmill::test
