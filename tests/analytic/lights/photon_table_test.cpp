// Photons of distant lights, of many lights at once, and of no lights. Noise is bounded by 5 standard errors: a false
// alarm once in 1.7 million channels.
#include <limits>

#include "tests/analytic/lights/photon_checks.h"

namespace lightmill::test {
namespace {

const BoundingSphere kTableScene{{1, 2, 3}, kSceneRadius};

PhotonEmission table_emission_of(const LightTable& table, const std::vector<BoundingSphere>& targets,
                                 const std::vector<InfinitePlane>& planes = {}) {
  return PhotonEmission(table, targets, planes, kTableScene);
}

Mean exactly(const Vec3d& flux) {
  return {flux, Vec3d(0)};
}

// ---- light from infinitely far ----

const std::vector<BoundingSphere> kTargets{{{3, 0, 0}, 1.5}, {{2, 2, 0}, 1.2}, {{-4, 0.5, 9}, 0.02}};

LightTable sun_table() {
  return table_of([](LightTable& t) { t.directional.add({glm::normalize(Vec3(1, -2, 0.5f)), kColor}); });
}

TEST(PhotonEmission, TheSunLightsTheCrossSectionOfEachTarget) {
  const LightTable table = sun_table();
  const PhotonEmission emission = table_emission_of(table, kTargets);
  for (const BoundingSphere& t : kTargets) {
    const BoundingSphere within{t.center, 0.99 * t.radius};
    expect_flux(photon_flux(emission, 1, into(within)), exactly(Vec3d(kColor) * M_PI * within.radius * within.radius),
                2e-3);
  }
  const PhotonEmission alone = table_emission_of(table, {kTargets[0]});
  expect_flux(photon_flux(alone, 2, into({kTargets[0].center, 2})), exactly(Vec3d(kColor) * M_PI * 2.25), 1e-3);
  const PhotonEmission all = table_emission_of(table, {kEverything, kTargets[2]});
  expect_flux(photon_flux(all, 3, into(kTableScene)), exactly(Vec3d(kColor) * M_PI * 400.0), 1e-3);
  expect_flux(photon_flux(all, 4, into(kTargets[2])), exactly(Vec3d(kColor) * M_PI * 0.0004), 2e-3);
}

TEST(PhotonEmission, AConstantEnvironmentGivesPiTimesTheSurface) {
  const LightTable table = table_of([](LightTable& t) { t.environment = EnvironmentRadiance(kColor); });
  const PhotonEmission emission = table_emission_of(table, kTargets);
  for (const BoundingSphere& t : kTargets) {
    const BoundingSphere within{t.center, 0.99 * t.radius};
    const Vec3d flux = Vec3d(kColor) * M_PI * 4.0 * M_PI * within.radius * within.radius;
    expect_flux(photon_flux(emission, 5, into(within)), exactly(flux), 2e-3);
  }
}

TEST(PhotonEmission, AnUnsampledEnvironmentCanBeLeftOut) {
  const LightTable constant = table_of([](LightTable& t) { t.environment = EnvironmentRadiance(kColor); });
  EXPECT_TRUE(PhotonEmission(constant, kTargets, {}, kTableScene, false).empty());
  const LightTable image = table_of([](LightTable& t) {
    t.environment = EnvironmentRadiance({.rgb = {1, 1, 1, 2, 2, 2}, .width = 1, .height = 2}, kColor);
  });
  EXPECT_FALSE(PhotonEmission(image, kTargets, {}, kTableScene, false).empty());
}

TEST(PhotonEmission, EnvironmentImagesEmitAllOfTheirLight) {
  // Dark, dim and very bright places.
  std::vector<float> rgb;
  for (int i = 0; i < 32 * 16; ++i) {
    const float v = i == 101 ? 900.0f : i % 32 < 8 ? 0.0f : 0.3f + 0.1f * static_cast<float>(i % 7);
    rgb.insert(rgb.end(), {v, 0.5f * v + 0.1f, i % 32 < 20 ? v : 0.0f});
  }
  const LightTable table = table_of([&](LightTable& t) {
    t.environment = EnvironmentRadiance({.rgb = rgb, .width = 32, .height = 16, .rotation_degrees = 33}, kColor);
  });
  // The directions in three bands of latitude, by a grid.
  constexpr int kHeights = 512, kTurns = 1024;
  const auto band = [](double y) { return y > 0.6 ? 0 : y > -0.3 ? 1 : 2; };
  Vec3d expected[3] = {Vec3d(0), Vec3d(0), Vec3d(0)};
  for (int i = 0; i < kHeights; ++i) {
    const double y = (i + 0.5) / kHeights * 2 - 1, r = std::sqrt(1 - y * y);
    for (int j = 0; j < kTurns; ++j) {
      const double phi = 2 * M_PI * (j + 0.5) / kTurns;
      const Vec3 to_light(Vec3d(r * std::cos(phi), y, r * std::sin(phi)));
      expected[band(y)] +=
          VectorLanes(table.environment.radiance(broadcast(to_light)))[0] * (4 * M_PI / (double{kHeights} * kTurns));
    }
  }
  const BoundingSphere receiver{kTargets[0].center, 1.4};
  const PhotonEmission emission = table_emission_of(table, kTargets);
  for (int b = 0; b < 3; ++b) {
    const Mean flux = photon_flux(
        emission, 6, [&](const PhotonRay& ray) { return band(-ray.direction.y) == b && meets(receiver, ray); });
    EXPECT_LT(flux.error.x, 0.02 * flux.value.x);
    expect_flux(flux, exactly(expected[b] * M_PI * receiver.radius * receiver.radius), 5e-3);
  }
}

TEST(PhotonEmission, DistantLightStartsBeyondAllThatIsInItsWay) {
  const LightTable table = table_of([](LightTable& t) { t.environment = EnvironmentRadiance(kColor); });
  const std::vector<InfinitePlane> planes{{{0, -30, 0}, {0, 1, 0}}, {{1, 0, 0}, glm::normalize(Vec3d(1, 1, 0))}};
  const PhotonEmission emission = table_emission_of(table, {kEverything, kTargets[0]}, planes);
  int near_the_scene = 0;
  for_each_photon(emission, 7, [&](const PhotonRay& ray, const Vec3d& power, std::uint32_t) {
    ASSERT_GT(power.x, 0);
    ASSERT_GT(glm::length(ray.origin - kTableScene.center), kTableScene.radius);
    ASSERT_GT(glm::dot(kTableScene.center - ray.origin, ray.direction), kTableScene.radius);
    for (const InfinitePlane& plane : planes) {
      const double height = glm::dot(ray.origin - plane.point, plane.normal);
      const double across = glm::dot(ray.direction, plane.normal);
      // On the side that the ray comes from. A ray almost along the plane crosses it too far away to tell.
      ASSERT_TRUE(height * across < 0 || std::abs(across) < 1e-6) << height << " " << across;
    }
    near_the_scene += glm::length(ray.origin - kTableScene.center) < 10 * kTableScene.radius ? 1 : 0;
  });
  EXPECT_GT(near_the_scene, 0.8 * kDraws);  // rays that cross a plane at more than about 10°
}

TEST(PhotonEmission, LightAlongAPlaneStartsNearTheScene) {
  const LightTable table = table_of([](LightTable& t) { t.directional.add({{1, 0, 0}, kColor}); });
  const PhotonEmission emission =
      table_emission_of(table, {kTargets[0]}, {{{0, -1, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 1, 0}}});
  for_each_photon(emission, 8, [&](const PhotonRay& ray, const Vec3d&, std::uint32_t) {
    ASSERT_LT(glm::length(ray.origin - kTableScene.center), 2 * kTableScene.radius);
  });
}

// ---- many lights ----

TEST(PhotonEmission, EachOfManyLightsEmitsItsFlux) {
  const auto facets = [](LightTable& t) {
    t.facets.add({{-3, 5, -1}, {1, 0, 0}, {0, 0, 1}, kColor * 3.0f, true, true, 0});
    t.facets.add({{3, 5, -1}, {1, 0, 0}, {0, 0, 1}, kColor * 0.01f, true, false, 0});
  };
  const auto spheres = [](LightTable& t) { t.spheres.add({{-6, 1, 0}, 0.5f, kColor, false, false, 0}); };
  const auto points = [](LightTable& t) { t.points.add({{0, 6, 4}, kColor}); };
  const auto spots = [](LightTable& t) { t.spots.add({{0, 0, -9}, {0, 0, 1}, kColor * 9.0f, 0.02f, 0.03f}); };
  const auto suns = [](LightTable& t) { t.directional.add({glm::normalize(Vec3(1, -2, 0.5f)), kColor * 0.1f}); };
  const auto sky = [](LightTable& t) { t.environment = EnvironmentRadiance(kColor * 0.02f); };
  const LightTable together =
      table_of([&](LightTable& t) { facets(t), spheres(t), points(t), spots(t), suns(t), sky(t); });
  const std::vector<BoundingSphere> targets{{{0, 0, 0}, 2}, {{1, 1, 0}, 2}, {{-3, 2, 1}, 0.5}};
  const BoundingSphere receiver{{0, 0, 0}, 1.9};
  const PhotonEmission all = table_emission_of(together, targets);
  const auto expect_same = [&](std::uint32_t light, const LightTable& alone, std::uint32_t number) {
    const PhotonEmission its = table_emission_of(alone, targets);
    const Mean part = photon_flux(all, 9, into(receiver), light);
    EXPECT_LT(part.error.x, 0.2 * part.value.x) << light;
    expect_flux(part, photon_flux(its, 10, into(receiver), number));
  };
  expect_same(0, table_of(facets), 0);
  expect_same(1, table_of(facets), 1);
  expect_same(2, table_of(spheres), 0);
  expect_same(3, table_of(points), 0);
  expect_same(4, table_of(spots), 0);
  expect_same(5, table_of(suns), 0);
  expect_same(6, table_of(sky), 0);
  EXPECT_EQ(together.first(LightKind::environment), 6u);
}

TEST(PhotonEmission, LanesAreIndependent) {
  const LightTable table = table_of([](LightTable& t) {
    t.facets.add({{-3, 5, -1}, {1, 0, 0}, {0, 0, 1}, kColor, true, true, 2});
    t.points.add({{0, 0.5f, 0}, kColor});
    t.spots.add({{0, 0, -9}, {0, 0, 1}, kColor, 0.02f, 0.03f});
    t.environment = EnvironmentRadiance(kColor);
  });
  const PhotonEmission emission = table_emission_of(table, {{{0, 0, 0}, 2}, {{5, 1, 0}, 2}, {{-3, 5, -1}, 0.5}});
  const U8 turned = (U8::lane_index() + U8(3u)) & U8(7u);
  for (std::uint32_t i = 0; i < 200; ++i) {
    const auto pairs = [&](U8 lanes) {
      const auto pair = [&](std::uint32_t d) { return hashed_pair(U8(8 * i) + lanes, U8(mix(d))); };
      return emission.emit(pair(1), pair(2), pair(3));
    };
    const PhotonEmission::Photon8 a = pairs(U8::lane_index()), b = pairs(turned);
    const auto same = [&](F8 x, F8 y) { return (float_bits(permute(x, turned)) == float_bits(y)).bits(); };
    EXPECT_EQ(same(masked(a.valid, a.origin.x), masked(b.valid, b.origin.x)), 255);
    EXPECT_EQ(same(masked(a.valid, a.direction.y), masked(b.valid, b.direction.y)), 255);
    EXPECT_EQ(same(a.power.z, b.power.z), 255);
  }
}

TEST(PhotonEmission, AMillionLightsReachOneOfAThousandTargets) {
  // So many that several lights share an entry of the choice table. The last entry is not full.
  constexpr std::size_t kLights = (std::size_t{1} << 20) + 12'345;
  LightTable table;
  const auto place = [](std::size_t i) {
    const float turn = static_cast<float>(i) * 0.001f;
    return Vec3(3 * std::cos(turn), static_cast<float>(i % 100) * 0.01f, 3 * std::sin(turn));
  };
  for (std::size_t i = 0; i < kLights; ++i) {
    table.points.add({place(i), i + 1 < kLights ? Vec3(1, 0, 0) : Vec3(0, 0, 1e6f)});
  }
  table.build();
  std::vector<BoundingSphere> targets;
  for (int i = 0; i < 1000; ++i) {
    targets.push_back({{0.1 * (i % 10), 0.1 * (i / 10 % 10), 0.1 * (i / 100)}, 0.04});
  }
  const PhotonEmission emission = table_emission_of(table, targets);
  const BoundingSphere receiver{{0.3, 0.4, 0.5}, 0.04};
  Vec3d expected(0);
  for (std::size_t i = 0; i < kLights; ++i) {
    const double d = glm::length(receiver.center - Vec3d(place(i)));
    const double solid_angle = 2 * M_PI * (1 - std::sqrt(1 - 0.0016 / (d * d)));
    expected += Vec3d(i + 1 < kLights ? Vec3(1, 0, 0) : Vec3(0, 0, 1e6f)) * solid_angle;
  }
  const Mean flux = photon_flux(emission, 11, into(receiver));
  EXPECT_LT(flux.error.x, 0.1 * flux.value.x);
  EXPECT_LT(flux.error.z, 0.1 * flux.value.z);
  expect_flux(flux, exactly(expected), 1e-4);
}

// ---- none ----

TEST(PhotonEmission, IsEmptyWhereNoLightReachesATarget) {
  const BoundingSphere target{{0, 0, 5}, 1};
  const PhotonEmission none = table_emission_of(table_of([](LightTable&) {}), {target});
  EXPECT_TRUE(none.empty());
  EXPECT_TRUE(none.emit(kNoChoice, kNoChoice, kNoChoice).valid.none());
  EXPECT_TRUE(table_emission_of(sun_table(), {}).empty());
  EXPECT_FALSE(table_emission_of(sun_table(), {target}).empty());
  const auto facet = [](const Vec3& corner, bool two_sided) {
    return table_of([&](LightTable& t) { t.facets.add({corner, {1, 0, 0}, {0, 1, 0}, kColor, two_sided, true, 0}); });
  };
  EXPECT_FALSE(table_emission_of(facet({0, 0, 0}, false), {target}).empty());
  EXPECT_FALSE(table_emission_of(facet({0, 0, 5.9f}, false), {target}).empty());
  EXPECT_TRUE(table_emission_of(facet({0, 0, 6.1f}, false), {target}).empty());
  const auto sphere = [](float radius, bool inward) {
    return table_of([&](LightTable& t) { t.spheres.add({{0, 0, 4.5f}, radius, kColor, inward, false, 0}); });
  };
  EXPECT_TRUE(table_emission_of(sphere(1.6f, false), {target}).empty());
  EXPECT_FALSE(table_emission_of(sphere(1.4f, false), {target}).empty());
  EXPECT_FALSE(table_emission_of(sphere(1.6f, true), {target}).empty());
  EXPECT_FALSE(table_emission_of(facet({0, 0, 6.1f}, true), {target}).empty());
  const auto spot = [](const Vec3& direction, float one_minus_cos) {
    return table_of([&](LightTable& t) {
      t.spots.add({{0, 0, 0}, glm::normalize(direction), kColor, 0, one_minus_cos});
    });
  };
  EXPECT_FALSE(table_emission_of(spot({0, 0, 1}, 0.01f), {target}).empty());
  // The target fills asin(1/5) = 11.5°, the spot 8.1°; 19.8° and 18.3° off the axis.
  EXPECT_TRUE(table_emission_of(spot({0.36f, 0, 1}, 0.01f), {target}).empty());
  EXPECT_FALSE(table_emission_of(spot({0.33f, 0, 1}, 0.01f), {target}).empty());
  EXPECT_TRUE(table_emission_of(spot({0, 0, -1}, 0.9f), {target}).empty());
  const auto cosine = [](const Vec3& direction) {
    return table_of([&](LightTable& t) { t.cosine_powers.add({{0, 0, 0}, glm::normalize(direction), kColor, 5}); });
  };
  EXPECT_TRUE(table_emission_of(cosine({0, 0, -1}), {target}).empty());
  EXPECT_FALSE(table_emission_of(cosine({1, 0, -0.15f}), {target}).empty());
}

TEST(PhotonEmission, LightsThatMissTheTargetsGetNoPhotons) {
  const LightTable table = table_of([](LightTable& t) {
    t.spots.add({{0, 0, 0}, {0, 0, -1}, kColor * 100.0f, 0, 0.01f});
    t.spots.add({{0, 0, 0}, {0, 0, 1}, kColor, 0, 0.01f});
  });
  const PhotonEmission emission = table_emission_of(table, {{{0, 0, 5}, 1}});
  for_each_photon(emission, 12, [&](const PhotonRay&, const Vec3d&, std::uint32_t light) { ASSERT_EQ(light, 1u); });
}

// ---- targets ----

TEST(PhotonTargets, FewGroupsHoldAllTargets) {
  std::vector<BoundingSphere> spheres;
  for (int i = 0; i < 1000; ++i) {
    const auto number = [&](std::uint32_t d) {
      return static_cast<double>(mix(static_cast<std::uint32_t>(i) * 3 + d)) * 0x1p-32;
    };
    spheres.push_back({{number(0) * 10, number(1), number(2)}, 0.1 * number(1)});
  }
  for (const std::size_t most : {2, 5, 32}) {
    const std::vector<BoundingSphere> groups = group_targets(spheres, most);
    EXPECT_EQ(groups.size(), most);
    for (const BoundingSphere& s : spheres) {
      EXPECT_TRUE(std::ranges::any_of(groups, [&](const BoundingSphere& g) {
        return glm::length(g.center - s.center) + s.radius <= g.radius * (1 + 1e-12);
      }));
    }
  }
  // The groups halve the long side, so each is far smaller than one around all.
  for (const BoundingSphere& g : group_targets(spheres, 32)) {
    EXPECT_LT(g.radius, 1);
  }
  // A few spheres stay as they are, except for their order. Infinite ones become one.
  spheres.resize(3);
  spheres.insert(spheres.begin(), 2, kEverything);
  const std::vector<BoundingSphere> few = group_targets(spheres, 32);
  ASSERT_EQ(few.size(), 4u);
  EXPECT_FALSE(std::isfinite(few.back().radius));
  double radii = 0, expected = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    radii += few[i].radius;
    expected += spheres[i + 2].radius;
  }
  EXPECT_NEAR(radii, expected, 1e-15);
}

// ---- density of the drawn photons ----

/// The power of every photon of kColor times its density is the emitted quantity of its light: I, L cosθ, E across
/// suns, L of skies.
void expect_densities(const LightTable& table, const std::vector<BoundingSphere>& targets) {
  const PhotonEmission emission = table_emission_of(table, targets);
  const U8 first_point(table.first(LightKind::point));
  int valid = 0;
  for (std::uint32_t i = 0; i < 20000; i += 8) {
    const U8 index = U8(i) + U8::lane_index();
    const PhotonEmission::Photon8 p =
        emission.emit(hashed_pair(index, U8(1u)), hashed_pair(index, U8(2u)), hashed_pair(index, U8(3u)));
    const F8 density = emission.pdf(p.light, p.origin, p.direction, p.cosine, p.valid);
    const F8 expected = select(signed_less(p.light, first_point), p.cosine, F8(1.0f)) * F8(kColor.y);
    alignas(32) float product[8], exact[8];
    (p.power.y * density).store(product);
    expected.store(exact);
    for (int lane = 0; lane < 8; ++lane) {
      if (p.valid.bits() >> lane & 1) {
        ASSERT_NEAR(product[lane], exact[lane], 2e-3 * exact[lane])
            << "photon " << i + static_cast<std::uint32_t>(lane);
        ++valid;
      }
    }
  }
  EXPECT_GT(valid, 5000);
}

TEST(PhotonEmission, PowerTimesDensityIsTheEmittedLight) {
  const LightTable all = table_of([](LightTable& t) {
    t.facets.add({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, kColor, false, true, 0});
    t.facets.add({{3, 0, 0}, {1, 0, 1}, {0, 2, 0}, kColor, true, false, 0});
    t.points.add({{0, 3, 1}, kColor});
    t.directional.add({glm::normalize(Vec3(1, -2, 0.5f)), kColor});
    t.environment = EnvironmentRadiance(kColor);
  });
  // For the sphere of the whole scene. For lights without surfaces also with overlapping cones and shadows.
  expect_densities(all, {kTableScene});
  expect_densities(all, {kEverything});
  const LightTable open = table_of([](LightTable& t) {
    t.points.add({{0, 3, 1}, kColor});
    t.directional.add({glm::normalize(Vec3(1, -2, 0.5f)), kColor});
    t.environment = EnvironmentRadiance(kColor);
  });
  expect_densities(open, {{{3, 0, 0}, 1.5}, {{2, 2, 0}, 1.2}, {{-4, 0.5, 3}, 1}});
}

}  // namespace
}  // namespace lightmill::test
