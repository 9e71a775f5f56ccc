// Light choice: by power for few lights, by a tree for many, always with the stated probability.
// The threshold of 5 standard deviations raises a false alarm once in 3.5 million tests.
#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

struct IndexLanes {
  alignas(32) std::uint32_t v[8];
  explicit IndexLanes(U8 x) { x.store(v); }
};

TEST(LightChoice, FewLightsAreChosenByPower) {
  LightTable table;
  // Area 1/2, radiance 2: power π. Area π, radiance 1: power π². 4π · .5 = 2π.
  table.facets.add({{0, 0, 5}, {0, 1, 0}, {1, 0, 0}, {2, 2, 2}, false, false, 0});
  table.spheres.add({{3, 0, 5}, 0.5f, {1, 1, 1}, false, false, 0});
  table.points.add({{-3, 0, 5}, {0.5f, 0.5f, 0.5f}});
  table.build(5);
  std::vector<double> counts(3);
  for_each_draw(1, [&](Pair8 choice, Pair8) {
    const VectorLanes point(table.sample(broadcast(Vec3(0)), choice, {F8(0.5f), F8(0.5f)}).point);
    for (int lane = 0; lane < 8; ++lane) {
      counts[point[lane].x < -1 ? 2 : point[lane].x > 1.5 ? 1 : 0] += 1;
    }
  });
  const double total = M_PI + M_PI * M_PI + 2 * M_PI;
  const std::vector<double> expected{kDraws * M_PI / total, kDraws * M_PI * M_PI / total, kDraws * 2 * M_PI / total};
  EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold);
}

TEST(LightChoice, AWeakLightBesideAStrongOneIsDrawn) {
  // One is 1e9 times as strong as the other. Both are drawn.
  LightTable table;
  table.points.add({{0, 0, 1}, Vec3(1e9f)});
  table.points.add({{0, 1, 0}, Vec3(1)});
  table.build(1);
  int weak = 0;
  for_each_draw(2, [&](Pair8 choice, Pair8 u) {
    const VectorLanes point(table.sample(broadcast(Vec3(0)), choice, u).point);
    for (int lane = 0; lane < 8; ++lane) {
      weak += point[lane].y > 0.5 ? 1 : 0;
    }
  });
  EXPECT_GT(weak, kDraws / 500);
}

/// Lights of all kinds at random places around the origin.
std::vector<LightBounds> many_lights(int count) {
  std::vector<LightBounds> lights;
  std::uint32_t state = 7;
  const auto random = [&] {
    state = mix(state + 0x9e3779b9u);
    return (state >> 8) * 0x1p-24;
  };
  for (int i = 0; i < count; ++i) {
    LightBounds b;
    b.low = Vec3d(random(), random(), random()) * 10.0 - 5.0;
    b.high = b.low + Vec3d(random(), random(), random()) * (i % 3 == 0 ? 0.0 : 0.3);
    if (i % 2 == 0) {
      b.axis = glm::normalize(Vec3d(random(), random(), random()) - 0.5);
      b.cos_normals = i % 4 == 0 ? 1 : 0.8;
      b.cos_emission = 0;
      b.two_sided = i % 10 == 0;
    }
    b.power = 0.01 + random() * random() * 100;
    lights.push_back(b);
  }
  return lights;
}

std::vector<double> probabilities(const LightBvh& tree, int count, const Vec3& p) {
  std::vector<double> out;
  for (int i = 0; i < count; ++i) {
    out.push_back(Lanes(tree.pmf(broadcast(p), U8(static_cast<std::uint32_t>(i)), M8(true)))[5]);
  }
  return out;
}

TEST(LightChoice, TheTreeDrawsWithTheProbabilityThatItStates) {
  constexpr int kLights = 300;
  const LightBvh tree(many_lights(kLights));
  for (const Vec3& p : {Vec3(0), Vec3(4, -3, 1), Vec3(50, 20, 0)}) {
    // The last cell counts failed draws: a node seemed to shine on the point, but none of its children does.
    std::vector<double> counts(kLights + 1), expected;
    double sum = 0;
    for (const double probability : probabilities(tree, kLights, p)) {
      expected.push_back(kDraws * probability);
      sum += probability;
    }
    EXPECT_GT(sum, 0.98);
    EXPECT_LT(sum, 1 + 1e-5);
    expected.push_back(kDraws * std::max(1 - sum, 0.0));
    for_each_draw(3, [&](Pair8 choice, Pair8) {
      const LightBvh::Choice8 chosen = tree.sample(broadcast(p), choice.u, choice.v);
      const IndexLanes light(chosen.light);
      const Lanes stated(chosen.pmf), again(tree.pmf(broadcast(p), chosen.light, M8(true)));
      for (int lane = 0; lane < 8; ++lane) {
        counts[stated[lane] > 0 ? light.v[lane] : kLights] += 1;
        if (stated[lane] > 0) {
          ASSERT_EQ(stated[lane], again[lane]);  // the same bits
        }
      }
    });
    EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold) << p.x;
  }
}

TEST(LightChoice, EveryLightThatShinesOnAPointCanBeDrawn) {
  constexpr int kLights = 1000;
  const std::vector<LightBounds> lights = many_lights(kLights);
  const LightBvh tree(lights);
  for (int i = 0; i < 50; ++i) {
    const Vec3 p(std::sin(i * 1.7) * 6, std::sin(i * 2.9) * 6, std::cos(i * 4.1) * 6);
    const std::vector<double> pmf = probabilities(tree, kLights, p);
    for (int light = 0; light < kLights; ++light) {
      const LightBounds& b = lights[light];
      const Vec3d center = (b.low + b.high) * 0.5, d = glm::normalize(Vec3d(p) - center);
      double cosine = glm::dot(d, b.axis);
      cosine = b.two_sided ? std::abs(cosine) : cosine;
      // Some normal of the cone is at an angle of at most 90°.
      const bool shines =
          b.cos_normals == -1 || std::acos(std::clamp(cosine, -1.0, 1.0)) - std::acos(b.cos_normals) < M_PI / 2 - 1e-6;
      if (shines) {
        ASSERT_GT(pmf[light], 0) << i << ' ' << light;
      }
    }
  }
}

TEST(LightChoice, NearLightsAreDrawnMoreOften) {
  std::vector<LightBounds> lights;
  for (int i = 0; i < 1000; ++i) {
    LightBounds b;
    b.low = b.high = Vec3d(i, 0, 0);
    b.power = 1;
    lights.push_back(b);
  }
  const LightBvh tree(lights);
  const std::vector<double> pmf = probabilities(tree, 1000, Vec3(500, 1, 0));
  EXPECT_GT(pmf[500], 100 * pmf[100]);
  EXPECT_GT(pmf[500], 0.05);
}

TEST(LightChoice, TheTreeBalancesAHundredThousandLightsInOnePlace) {
  std::vector<LightBounds> lights(100'000);
  for (LightBounds& b : lights) {
    b.power = 1;
  }
  const LightBvh tree(lights);
  const Lanes pmf(tree.sample(broadcast(Vec3(1, 0, 0)), F8(0.3f), F8(0.7f)).pmf);
  EXPECT_NEAR(pmf[0] * 100'000, 1, 0.5);  // a balanced tree's leaves differ by one level
}

TEST(LightChoice, DistantLightsAndTheTreeAreBothDrawn) {
  LightTable table;
  for (int i = 0; i < 40; ++i) {
    table.points.add({{static_cast<float>(i), 5, 0}, Vec3(1)});
  }
  table.directional.add({{0, -1, 0}, Vec3(1)});
  table.build(1000);  // so large that the sun has almost all of the flux
  int sun = 0;
  for_each_draw(4, [&](Pair8 choice, Pair8 u) {
    const LightSample8 s = table.sample(broadcast(Vec3(3, 0, 0)), choice, u);
    const VectorLanes point(s.point);
    const Lanes weight(s.weight.x);
    for (int lane = 0; lane < 8; ++lane) {
      if (point[lane].y > 1e9) {
        ++sun;
        ASSERT_NEAR(weight[lane], 1 / 0.75, 1e-3);
      }
    }
  });
  EXPECT_NEAR(sun / double{kDraws}, 0.75, 0.01);
}

}  // namespace
}  // namespace lightmill::test
