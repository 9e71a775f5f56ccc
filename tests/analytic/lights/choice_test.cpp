// Light choice: a point samples all of few lights. Otherwise it draws one, with the stated probability and a bounded
// variance. The threshold of 5 standard deviations raises a false alarm once in 3.5 million tests.
#include <numeric>

#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {
namespace {

struct IndexLanes {
  alignas(32) std::uint32_t v[8];
  explicit IndexLanes(U8 x) { x.store(v); }
};

/// Numbers in [0, 1), always the same.
class Numbers {
 public:
  double operator()() {
    state_ = mix(state_ + 0x9e3779b9u);
    return (state_ >> 8) * 0x1p-24;
  }
  Vec3d vector() { return {(*this)(), (*this)(), (*this)()}; }

 private:
  std::uint32_t state_ = 7;
};

TEST(LightChoice, UpToFourLightsAreAllSampled) {
  LightTable table;
  table.facets.add({{0, 0, 5}, {0, 1, 0}, {1, 0, 0}, {2, 2, 2}, false, false, 0});
  table.points.add({{-3, 0, 5}, Vec3(1e9f)});
  table.points.add({{3, 4, 0}, Vec3(50)});
  table.directional.add({{0, 0, 1}, Vec3(3)});
  table.build();
  ASSERT_EQ(table.draws(), 4u);
  const auto draw = [&](std::uint32_t number) {
    return table.sample(broadcast(Vec3(0)), number, kNoChoice, {F8(0.5f), F8(0.5f)});
  };
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(IndexLanes(draw(i).light).v[3], i);
    EXPECT_EQ(Lanes(table.choice_pmf(broadcast(Vec3(0)), U8(i), M8(true)))[3], 1);
  }
  // Each is the light of its own: I/d² and E, whatever the others are.
  EXPECT_FLOAT_EQ(static_cast<float>(Lanes(draw(1).weight.x)[0]), 1e9f / 34);
  EXPECT_FLOAT_EQ(static_cast<float>(Lanes(draw(2).weight.x)[0]), 2);
  EXPECT_EQ(Lanes(draw(3).weight.x)[0], 3);
}

/// Lights of all kinds at random places around the origin.
std::vector<LightBounds> many_lights(int count) {
  std::vector<LightBounds> lights;
  Numbers random;
  for (int i = 0; i < count; ++i) {
    LightBounds b;
    b.low = random.vector() * 10.0 - 5.0;
    b.high = b.low + random.vector() * (i % 3 == 0 ? 0.0 : 0.3);
    if (i % 2 == 0) {
      b.axis = glm::normalize(random.vector() - 0.5);
      b.cos_normals = i % 4 == 0 ? 1 : 0.8;
      b.cos_emission = i % 8 == 0 ? 0.9 : 0;
      b.two_sided = i % 10 == 0;
    }
    b.power = 0.01 + random() * random() * 100;
    b.intensity = b.power * (0.1 + random());
    lights.push_back(b);
  }
  return lights;
}

std::vector<double> probabilities(const LightChoice& choice, int count, const Vec3& p) {
  std::vector<double> out;
  for (int i = 0; i < count; ++i) {
    out.push_back(Lanes(choice.pmf(broadcast(p), U8(static_cast<std::uint32_t>(i)), M8(true)))[5]);
  }
  return out;
}

/// Draws of a choice among `count` lights agree with the probabilities that it states.
void expect_stated_probabilities(const LightChoice& choice, int count) {
  for (const Vec3& p : {Vec3(0), Vec3(4, -3, 1), Vec3(50, 20, 0)}) {
    // The last cell counts failed draws: a node seemed to shine on the point, but none of its children does.
    std::vector<double> counts(count + 1), expected;
    double sum = 0;
    for (const double probability : probabilities(choice, count, p)) {
      expected.push_back(kDraws * probability);
      sum += probability;
    }
    EXPECT_GT(sum, 0.8);
    EXPECT_LT(sum, 1 + 1e-5);
    expected.push_back(kDraws * std::max(1 - sum, 0.0));
    for_each_draw(3, [&](Pair8 u, Pair8) {
      const LightChoice::Choice8 chosen = choice.sample(broadcast(p), V8(), u);
      const IndexLanes light(chosen.light);
      const Lanes stated(chosen.pmf_at_point), again(choice.pmf(broadcast(p), chosen.light, M8(true)));
      const Lanes without_normal(chosen.pmf);
      for (int lane = 0; lane < 8; ++lane) {
        counts[stated[lane] > 0 ? light.v[lane] : count] += 1;
        if (stated[lane] > 0) {
          ASSERT_EQ(stated[lane], again[lane]);  // the same bits
          ASSERT_NEAR(without_normal[lane], stated[lane], 1e-6 * stated[lane]);
        }
      }
    });
    EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold) << count << ' ' << p.x;
  }
}

TEST(LightChoice, DrawsWithTheProbabilityThatItStates) {
  for (const auto& [bounded, distant] : {std::pair{5, 0}, {14, 3}, {300, 0}, {300, 40}, {0, 9}}) {
    std::vector<DistantBounds> suns;
    for (int i = 0; i < distant; ++i) {
      suns.push_back({0.3 + i % 4});
    }
    expect_stated_probabilities(LightChoice(many_lights(bounded), suns), bounded + distant);
  }
}

/// A choice for which each group of lights arrives in a part of the space of `many_lights`.
LightChoice with_visibility(LightChoice choice) {
  Numbers random;
  std::vector<LightVisibility::Sample> samples;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(random.vector() * 10.0 - 5.0);
    const bool left = p.x < 0;
    samples.push_back({p, ~0u, left ? 0x55555555u : 0xffff0000u});
  }
  choice.set_visibility(LightVisibility(samples, choice.entries()));
  return choice;
}

TEST(LightChoice, DrawsWithTheProbabilityThatItStatesByVisibility) {
  for (const auto& [bounded, distant] : {std::pair{5, 0}, {300, 40}, {0, 9}}) {
    std::vector<DistantBounds> suns;
    for (int i = 0; i < distant; ++i) {
      suns.push_back({0.3 + i % 4});
    }
    const LightChoice choice = with_visibility(LightChoice(many_lights(bounded), suns));
    expect_stated_probabilities(choice, bounded + distant);
  }
}

TEST(LightChoice, VisibilityLeavesAFifthToTheBounds) {
  // One light an entry: (1 − λ) x + λ/n becomes at least μ x + λ/n.
  constexpr int kLights = 16;
  const LightChoice choice(many_lights(kLights), {}), learned = with_visibility(choice);
  double most = 0;
  for (const Vec3& p : {Vec3(-4, 1, 2), Vec3(3, -2, 0), Vec3(50, 20, 0)}) {
    const std::vector<double> before = probabilities(choice, kLights, p), after = probabilities(learned, kLights, p);
    const double shining = static_cast<double>(std::ranges::count_if(before, [](double p) { return p > 0; }));
    for (int i = 0; i < kLights; ++i) {
      const double even = before[i] > 0 ? LightChoice::kUniformShare / shining : 0;
      const double least = LightChoice::kBoundShare / (1 - LightChoice::kUniformShare) * (before[i] - even) + even;
      EXPECT_GE(after[i], least * (1 - 1e-5));
      most = std::max(most, before[i] > 0 ? after[i] / before[i] : 0);
    }
  }
  EXPECT_GT(most, 1.2);  // where lights arrive, they are drawn more often
}

TEST(LightChoice, EveryLightThatShinesOnAPointCanBeDrawn) {
  constexpr int kLights = 1000;
  const std::vector<LightBounds> lights = many_lights(kLights);
  const LightChoice choice(lights, {});
  for (int i = 0; i < 50; ++i) {
    const Vec3 p(std::sin(i * 1.7) * 6, std::sin(i * 2.9) * 6, std::cos(i * 4.1) * 6);
    const std::vector<double> pmf = probabilities(choice, kLights, p);
    for (int light = 0; light < kLights; ++light) {
      const LightBounds& b = lights[light];
      const Vec3d center = (b.low + b.high) * 0.5, d = glm::normalize(Vec3d(p) - center);
      double cosine = glm::dot(d, b.axis);
      cosine = b.two_sided ? std::abs(cosine) : cosine;
      // Some normal of the cone is at an angle of at most the emission's.
      const bool shines = b.cos_normals == -1 || std::acos(std::clamp(cosine, -1.0, 1.0)) - std::acos(b.cos_normals) <
                                                     std::acos(b.cos_emission) - 1e-6;
      if (shines) {
        ASSERT_GT(pmf[light], 0) << i << ' ' << light;
      }
    }
  }
}

/// The variance of the choice over the square of its mean, if lights that are chosen with these probabilities give
/// these amounts: Σ f²/p / (Σ f)² − 1.
double relative_variance(const std::vector<double>& light, const std::vector<double>& pmf) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    sum += light[i];
    squares += light[i] > 0 ? light[i] * light[i] / pmf[i] : 0;
  }
  return squares / (sum * sum) - 1;
}

TEST(LightChoice, TheVarianceIsBoundedWhateverIsOccluded) {
  // Points of very unequal power and distance, and suns. Any of them may be hidden. The estimate of the rest has at
  // most the variance that light_choice.h derives.
  Numbers random;
  for (int scene = 0; scene < 200; ++scene) {
    std::vector<LightBounds> points(3 + scene % 14);
    std::vector<DistantBounds> suns(scene % 5 + (points.size() < 5 ? 2 : 0));
    for (LightBounds& b : points) {
      b.low = b.high = (random.vector() - 0.5) * std::exp(8 * random() - 2);
      b.intensity = std::exp(20 * random() - 10);
      b.power = 4 * M_PI * b.intensity;
    }
    for (DistantBounds& sun : suns) {
      sun.irradiance = std::exp(12 * random() - 6);
    }
    const int count = static_cast<int>(points.size() + suns.size());
    const LightChoice choice(points, suns);
    const Vec3 p((random.vector() - 0.5) * 4.0);
    const std::vector<double> pmf = probabilities(choice, count, p);
    std::vector<double> all;
    for (const LightBounds& b : points) {
      const Vec3d d = b.low - Vec3d(p);
      all.push_back(b.intensity / glm::dot(d, d));
    }
    for (const DistantBounds& sun : suns) {
      all.push_back(sun.irradiance);
    }
    const double total = std::accumulate(all.begin(), all.end(), 0.0);
    constexpr double kEven = LightChoice::kUniformShare;
    for (int hiding = 0; hiding < 20; ++hiding) {
      std::vector<double> seen = all;
      const auto kept = static_cast<std::size_t>(random() * count);
      for (std::size_t i = 0; i < seen.size(); ++i) {
        seen[i] = hiding > 0 && i != kept && random() < 0.7 ? 0 : all[i];
      }
      const double share = std::accumulate(seen.begin(), seen.end(), 0.0) / total;
      EXPECT_LE(relative_variance(seen, pmf), std::min(count / kEven, 1 / ((1 - kEven) * share)) - 1 + 1e-3)
          << scene << ' ' << hiding;
    }
  }
}

TEST(LightChoice, ANarrowSpotIsDrawnInItsConeAlone) {
  // Nineteen points of 1 W/sr, and a spot of 1° with 1e4 W/sr, whose flux is less than theirs.
  LightTable table;
  for (int i = 0; i < 19; ++i) {
    table.points.add({{static_cast<float>(i - 9), 5, 0}, Vec3(1)});
  }
  const auto outer = static_cast<float>(1 - std::cos(M_PI / 180));
  table.spots.add({{0, 5, 1}, {0, -1, 0}, Vec3(1e4f), outer, outer});
  table.build();
  const auto pmf_at = [&](const Vec3& p) {
    return Lanes(table.choice_pmf(broadcast(p), U8(table.first(LightKind::spot)), M8(true)))[0];
  };
  EXPECT_GT(pmf_at({0, 0, 1}), 0.8);
  EXPECT_EQ(pmf_at({0.5f, 0, 1}), 0);  // 5.7° off its axis
}

TEST(LightChoice, AnEmitterThatFacesAwayIsNotDrawn) {
  // As bright as it may be, it leaves all draws to the others.
  LightTable table;
  for (int i = 0; i < 5; ++i) {
    table.points.add({{static_cast<float>(i), 5, 0}, Vec3(1)});
  }
  table.facets.add({{0, 2, 0}, {0, 0, 1}, {1, 0, 0}, Vec3(1e9f), false, false, 0});  // upwards
  table.build();
  EXPECT_EQ(Lanes(table.choice_pmf(broadcast(Vec3(0)), U8(0u), M8(true)))[0], 0);
}

TEST(LightChoice, ASurfaceDrawsOnlyLightsAboveIt) {
  // Points, balls that reach through the horizon, and suns. The mean of 1/p over draws is the number of lights above.
  std::vector<LightBounds> lights = many_lights(12);
  for (LightBounds& b : lights) {
    b.cos_normals = b.cos_emission = -1;
  }
  const std::vector<DistantBounds> suns{{2, {0, 1, 0}, 0}, {2, {0, -1, 0}, 0}, {2, {0, -0.6, 0.8}, 0.7}, {1}};
  const LightChoice choice(lights, suns);
  const Vec3 p(0.5f, 0.3f, -0.2f), normal(0, 1, 0);
  double above = 3;  // the first, third and fourth sun
  for (const LightBounds& b : lights) {
    const double radius = glm::length(b.high - b.low) / 2;
    above += (b.low.y + b.high.y) / 2 + radius > p.y ? 1 : 0;
  }
  double sum = 0, squares = 0;
  for_each_draw(5, [&](Pair8 u, Pair8) {
    const LightChoice::Choice8 chosen = choice.sample(broadcast(p), broadcast(normal), u);
    const Lanes pmf(chosen.pmf);
    const IndexLanes light(chosen.light);
    for (int lane = 0; lane < 8; ++lane) {
      ASSERT_GT(pmf[lane], 0);
      ASSERT_NE(light.v[lane], 13u);  // the sun below
      sum += 1 / pmf[lane];
      squares += 1 / (pmf[lane] * pmf[lane]);
    }
  });
  const double mean = sum / kDraws;
  EXPECT_NEAR(mean, above, 5 * std::sqrt((squares / kDraws - mean * mean) / kDraws) + 1e-4);
}

TEST(LightChoice, NearLightsAreDrawnMoreOften) {
  std::vector<LightBounds> lights;
  for (int i = 0; i < 1000; ++i) {
    LightBounds b;
    b.low = b.high = Vec3d(i, 0, 0);
    b.power = b.intensity = 1;
    lights.push_back(b);
  }
  const std::vector<double> pmf = probabilities(LightChoice(lights, {}), 1000, Vec3(500, 1, 0));
  EXPECT_GT(pmf[500], 100 * pmf[100]);
  EXPECT_GT(pmf[500], 0.05);
}

TEST(LightChoice, TheTreeBalancesAHundredThousandLightsInOnePlace) {
  std::vector<LightBounds> lights(100'000);
  for (LightBounds& b : lights) {
    b.power = b.intensity = 1;
  }
  const LightChoice choice(lights, {});
  const Lanes pmf(choice.sample(broadcast(Vec3(1, 0, 0)), V8(), {F8(0.3f), F8(0.7f)}).pmf);
  EXPECT_NEAR(pmf[0] * 100'000, 1, 0.5);  // a balanced tree's leaves differ by one level
}

TEST(LightChoice, ASunIsDrawnByItsIrradianceInASceneOfAnySize) {
  // At 1 m from forty points in a row of 1 m spacing, a sun of 1 W/m² is one light of many. Far away it is all there is.
  LightTable table;
  for (int i = 0; i < 40; ++i) {
    table.points.add({{static_cast<float>(i), 1, 0}, Vec3(1)});
  }
  table.directional.add({{0, -1, 0}, Vec3(1)});
  table.build();
  const auto sun_at = [&](const Vec3& p) {
    return Lanes(table.choice_pmf(broadcast(p), U8(table.first(LightKind::directional)), M8(true)))[0];
  };
  EXPECT_GT(sun_at({20, 0, 0}), 0.05);
  EXPECT_LT(sun_at({20, 0, 0}), 0.5);
  EXPECT_GT(sun_at({20, 0, 1000}), 0.85);
}

}  // namespace
}  // namespace lightmill::test
