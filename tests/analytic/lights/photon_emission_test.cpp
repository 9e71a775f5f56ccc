// Photons bring the flux of formulas and next-event estimation, for all kinds of lights and targets. Noise is bounded
// by 5 standard errors: a false alarm once in 1.7 million channels.
#include <limits>

#include "tests/analytic/lights/photon_checks.h"

namespace lightmill::test {
namespace {

const BoundingSphere kScene{{0, 0, 0}, kSceneRadius};

PhotonEmission emission_of(const LightTable& table, const std::vector<BoundingSphere>& targets,
                           const std::vector<InfinitePlane>& planes = {}) {
  return PhotonEmission(table, targets, planes, kScene);
}

LightTable point_table(const Vec3& position = Vec3(0)) {
  return table_of([&](LightTable& t) { t.points.add({position, kColor}); });
}

Mean exactly(double share, const Vec3& color = kColor) {
  return {Vec3d(color) * share, Vec3d(0)};
}

double cone_solid_angle(double radius, double distance) {
  return 2 * M_PI * (1 - std::sqrt(1 - radius * radius / (distance * distance)));
}

auto through(const Quad& quad) {
  return [quad](const PhotonRay& ray) { return quad.hit(ray); };
}
bool anywhere(const PhotonRay&) {
  return true;
}

// ---- lights without extent ----

TEST(PhotonEmission, APointFillsTheSolidAngleOfASphere) {
  const LightTable table = point_table({1, 2, 3});
  for (const double radius : {1e-3, 0.5, 3.0, 4.999}) {
    const BoundingSphere target{{4, 2, 7}, radius};  // at a distance of 5
    const PhotonEmission emission = emission_of(table, {target});
    // Apart from the target's margin, all photons go to the target.
    const double margin = radius < 0.1 ? 0.1 : 2e-3;
    expect_flux(photon_flux(emission, 1, anywhere), exactly(cone_solid_angle(radius, 5)), margin);
    const BoundingSphere within{{4, 2, 7}, 0.9 * radius};
    expect_flux(photon_flux(emission, 2, into(within)), exactly(cone_solid_angle(0.9 * radius, 5)), 1e-3);
  }
}

TEST(PhotonEmission, OverlapsOfTargetsCountOnce) {
  const LightTable table = point_table();
  // The first two overlap, the third is within the first, and the fourth is in front of the second.
  const std::vector<BoundingSphere> targets{{{3, 0, 0}, 1.5}, {{2, 2, 0}, 1.2}, {{3, 0, 0.2}, 0.5}, {{1, 0.9, 0}, 0.3}};
  const PhotonEmission emission = emission_of(table, targets);
  for (const BoundingSphere& t : targets) {
    const BoundingSphere within{t.center, 0.999 * t.radius};
    expect_flux(photon_flux(emission, 3, into(within)),
                exactly(cone_solid_angle(within.radius, glm::length(t.center))));
  }
  // The solid angle of the union of all, counted over a fine grid of equal areas.
  constexpr int kHeights = 1500, kTurns = 3000;
  double covered = 0;
  for (int i = 0; i < kHeights; ++i) {
    const double z = (i + 0.5) / kHeights * 2 - 1, r = std::sqrt(1 - z * z);
    for (int j = 0; j < kTurns; ++j) {
      const double phi = 2 * M_PI * (j + 0.5) / kTurns;
      const PhotonRay ray{Vec3d(0), {r * std::cos(phi), r * std::sin(phi), z}};
      covered += std::ranges::any_of(targets, [&](const BoundingSphere& t) { return meets(t, ray); }) ? 1 : 0;
    }
  }
  expect_flux(photon_flux(emission, 4, anywhere), exactly(4 * M_PI * covered / (double{kHeights} * kTurns)), 1e-3);
}

TEST(PhotonEmission, ALightWithinATargetEmitsInAllDirections) {
  const LightTable table = point_table({1, 0, 0});
  // Inside, just touching from inside and outside, and infinite, also with a finite target beside it.
  expect_flux(photon_flux(emission_of(table, {{{0, 0, 0}, 2}}), 5, anywhere), exactly(4 * M_PI));
  expect_flux(photon_flux(emission_of(table, {{{0, 0, 0}, 1}}), 6, anywhere), exactly(4 * M_PI));
  expect_flux(photon_flux(emission_of(table, {kEverything}), 7, anywhere), exactly(4 * M_PI));
  const PhotonEmission both = emission_of(table, {kEverything, {{1, 0, 3}, 0.01}, {{1, 2, 0}, 0.5}});
  expect_flux(photon_flux(both, 8, anywhere), exactly(4 * M_PI));
  expect_flux(photon_flux(both, 9, into({{1, 0, 3}, 0.01})), exactly(cone_solid_angle(0.01, 3)), 1e-4);
  // From just outside, half of all directions lead into the sphere.
  const PhotonEmission outside = emission_of(table, {{{0, 0, 0}, 0.99}});
  expect_flux(photon_flux(outside, 10, into({{0, 0, 0}, 0.98})), exactly(cone_solid_angle(0.98, 1)));
}

TEST(PhotonEmission, DirectionsAreUniformInTheCone) {
  const LightTable table = point_table();
  const PhotonEmission emission = emission_of(table, {{{0, 0, 5}, 3}});
  constexpr int kHeights = 20, kSectors = 20;
  std::vector<double> counts(kHeights * kSectors), expected(kHeights * kSectors, kDraws / double{kHeights * kSectors});
  for_each_photon(emission, 11, [&](const PhotonRay& ray, const Vec3d& power, std::uint32_t) {
    ASSERT_NEAR(power.x, 2 * M_PI * 0.2, 1e-3);  // sin θmax = .6: all have the same power
    ASSERT_NEAR(glm::length(ray.direction), 1, 1e-6);
    const double height = (1 - ray.direction.z) / 0.2;
    ASSERT_LT(height, 1.001);
    const double turn = std::atan2(ray.direction.y, ray.direction.x) / (2 * M_PI) + 0.5;
    counts[std::min(kHeights - 1, static_cast<int>(height * kHeights)) * kSectors +
           std::min(kSectors - 1, static_cast<int>(turn * kSectors))] += 1;
  });
  EXPECT_LT(chi_squared_z(counts, expected), kChiSquaredThreshold);
}

/// Compares with next-event estimation at a quad inside the target.
void expect_as_sampled(const LightTable& table, const Quad& quad, std::uint32_t seed,
                       std::vector<BoundingSphere> more_targets = {}) {
  const Vec3d center = quad.corner + (quad.edge1 + quad.edge2) * 0.5;
  const double radius = std::max(glm::length(quad.edge1 + quad.edge2), glm::length(quad.edge1 - quad.edge2)) * 0.5;
  more_targets.push_back({center, radius});
  const PhotonEmission emission = emission_of(table, more_targets);
  const Mean expected = sampled_flux(table, seed, quad);
  ASSERT_GT(expected.value.x, 0);
  ASSERT_LT(expected.error.x, 0.03 * expected.value.x);
  const Mean flux = photon_flux(emission, seed, through(quad));
  ASSERT_LT(flux.error.x, 0.1 * expected.value.x);
  expect_flux(flux, expected, 1e-3);
}

const Quad kQuad{{-1, -1.2, 3}, {2, 0, 0.3}, {0.2, 1.8, 0.5}};

TEST(PhotonEmission, PointProfilesEmitTheFluxThatSamplingFinds) {
  const Vec3 axis = glm::normalize(Vec3(0.1f, -0.3f, 1));
  // A spot that the target contains, and one whose rim crosses the target.
  const LightTable narrow = table_of([&](LightTable& t) { t.spots.add({{0, 0, 0}, axis, kColor, 0.005f, 0.02f}); });
  expect_flux(photon_flux(emission_of(narrow, {{Vec3d(axis) * 6.0, 2}}), 12, anywhere), exactly(M_PI * 0.025), 1e-5);
  const LightTable spot = table_of([&](LightTable& t) { t.spots.add({{0, 0, 0}, axis, kColor, 0.01f, 0.06f}); });
  expect_as_sampled(spot, kQuad, 13);
  for (const float exponent : {0.0f, 1.0f, 30.0f}) {
    expect_as_sampled(table_of([&](LightTable& t) {
                        t.cosine_powers.add({{0.5f, 0, 0}, axis, kColor, exponent});
                      }),
                      kQuad, 14);
  }
  IesProfile profile{{0, 40, 90}, {0, 90, 180, 360}, {10, 5, 1, 3, 8, 0, 2, 1, 0, 10, 5, 1}};
  const LightTable ies = table_of([&](LightTable& t) {
    t.ies.add(
        {{0.5f, 0, 0}, axis, glm::normalize(glm::cross(axis, Vec3(1, 0, 0))), kColor, t.ies.add_profile(profile)});
  });
  expect_as_sampled(ies, kQuad, 15);
}

// ---- surfaces ----

EmissiveFacet facet_of(bool whole, bool two_sided, float exponent) {
  return {{-0.5f, -0.4f, 0.1f}, {1.2f, 0.1f, 0}, {0.2f, 0.9f, 0.2f}, kColor, two_sided, whole, exponent};
}

TEST(PhotonEmission, ParallelSquaresExchangeTheirFormFactor) {
  const LightTable table = table_of([](LightTable& t) {
    t.facets.add({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, kColor, false, true, 0});
  });
  const PhotonEmission emission = emission_of(table, {{{0.5, 0.5, 1}, 0.75}});
  const Quad facing{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  expect_flux(photon_flux(emission, 16, through(facing)), exactly(M_PI * 0.1998249));
  // All emitted flux: π L A for each side that emits.
  expect_flux(photon_flux(emission_of(table, {kEverything}), 17, anywhere), exactly(M_PI));
  const LightTable both = table_of([](LightTable& t) {
    t.facets.add({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, kColor, true, true, 0});
  });
  expect_flux(photon_flux(emission_of(both, {kEverything}), 18, anywhere), exactly(2 * M_PI));
  const Quad behind{{0, 0, -1}, {1, 0, 0}, {0, 1, 0}};
  expect_flux(photon_flux(emission_of(both, {{{0.5, 0.5, -1}, 0.75}}), 19, through(behind)), exactly(M_PI * 0.1998249));
  // A target that reaches behind the square, and one that contains the square.
  for (const double radius : {1.2, 3.0}) {
    expect_flux(photon_flux(emission_of(table, {{{0.5, 0.5, 1}, radius}}), 20, through(facing)),
                exactly(M_PI * 0.1998249));
  }
}

TEST(PhotonEmission, FacetsEmitTheFluxThatSamplingFinds) {
  std::uint32_t seed = 21;
  for (const bool whole : {false, true}) {
    for (const float exponent : {0.0f, 1.0f, 12.0f}) {
      for (const bool two_sided : {false, true}) {
        const LightTable table = table_of([&](LightTable& t) { t.facets.add(facet_of(whole, two_sided, exponent)); });
        expect_as_sampled(table, kQuad, seed++);
        // Beside it and through its plane, so partly behind.
        expect_as_sampled(table, {{0.9, -0.7, -1}, {0.3, 1.5, 0.1}, {0.4, 0.2, 2}}, seed++);
        // Targets that overlap others.
        expect_as_sampled(table, kQuad, seed++, {{{0, 0, 2}, 1.5}, {{2, 2, -1}, 1}, kEverything});
      }
    }
  }
}

TEST(PhotonEmission, TexelsEmitTheFluxThatSamplingFinds) {
  TextureSet textures;
  std::vector<float> values;
  for (int i = 0; i < 16; ++i) {
    const float v = static_cast<float>((i * 7) % 5);
    values.insert(values.end(), {v, 0.5f * v, i % 3 == 0 ? 1.0f : 0.0f, 1.0f});
  }
  const auto texels = std::make_shared<Texels>(Texels{4, 4, {}, std::move(values), false});
  textures.add(Texture(texels, {TextureFilter::nearest}));
  for (const bool whole : {false, true}) {
    const LightTable table = table_of([&](LightTable& t) {
      EmissiveFacet facet = facet_of(whole, false, 0);
      facet.texture = {0, {0.1f, 0.2f}, {0.8f, 0}, {0, 0.7f}};
      t.facets.set_textures(textures);
      t.facets.add(facet);
    });
    expect_as_sampled(table, kQuad, 61);
    expect_as_sampled(table, {{-0.4, -0.3, 0.5}, {0.3, 0, 0}, {0, 0.3, 0}}, 62);
  }
}

TEST(PhotonEmission, SpheresLightDiscsOutsideAndTargetsInside) {
  // From a sphere to a coaxial disc of radius R at distance d: (1 − 1 / √(1 + (R/d)²)) / 2 of its flux.
  const LightTable outward = table_of([](LightTable& t) { t.spheres.add({{0, 0, 0}, 0.5f, kColor, false, false, 0}); });
  const auto disc = [](const PhotonRay& ray) {
    const double t = (2 - ray.origin.z) / ray.direction.z;
    const Vec3d p = ray.origin + ray.direction * t;
    return t > 0 && p.x * p.x + p.y * p.y <= 1;
  };
  const double flux = M_PI * 4 * M_PI * 0.25;
  const PhotonEmission aimed = emission_of(outward, {{{0, 0, 2}, 1}});
  expect_flux(photon_flux(aimed, 63, disc), exactly(flux * (1 - 1 / std::sqrt(1.25)) / 2));
  expect_flux(photon_flux(emission_of(outward, {kEverything}), 64, anywhere), exactly(flux));
  // A quad very close to the sphere.
  expect_as_sampled(outward, {{-0.3, -0.3, 0.501}, {0.6, 0, 0}, {0, 0.6, 0}}, 65);

  const LightTable profile = table_of([](LightTable& t) { t.spheres.add({{0, 0, 0}, 0.5f, kColor, false, false, 3}); });
  expect_as_sampled(profile, kQuad, 66);
  // Both sides emit 2π/(n + 2) of their area.
  const LightTable both = table_of([](LightTable& t) { t.spheres.add({{0, 0, 0}, 0.5f, kColor, false, true, 3}); });
  expect_flux(photon_flux(emission_of(both, {kEverything}), 66, anywhere), exactly(2 * 2 * M_PI / 5 * M_PI));
  // Points are drawn where a target sees them. Points that several targets see count once.
  const std::vector<BoundingSphere> targets{{{0, 0, 2}, 1}, {{0.7, 0, 2}, 0.5}, {{0, 3, 0}, 0.1}, {{0.2, 0, 0.3}, 0.4}};
  int lit = 0;
  const PhotonEmission several = emission_of(outward, targets);
  expect_flux(photon_flux(several, 69, disc), exactly(flux * (1 - 1 / std::sqrt(1.25)) / 2));
  const PhotonEmission afar = emission_of(outward, {{{6, 0, 0}, 0.05}});
  for_each_photon(afar, 70, [&](const PhotonRay&, const Vec3d& power, std::uint32_t) { lit += power.x > 0 ? 1 : 0; });
  EXPECT_GT(lit, 0.98 * kDraws);
  expect_flux(photon_flux(afar, 71, into({{6, 0, 0}, 0.045})), exactly(M_PI * 0.25 * M_PI * 0.045 * 0.045 / 36), 2e-4);

  const LightTable inward = table_of([](LightTable& t) { t.spheres.add({{0, 0, 3}, 4, kColor, true, false, 0}); });
  expect_as_sampled(inward, kQuad, 67);
  expect_flux(photon_flux(emission_of(inward, {{{0, 1, 3}, 1.5}}), 68, into({{0, 1, 3}, 1.2})),
              exactly(M_PI * 4 * M_PI * 1.44));
}

TEST(PhotonEmission, RaysStartOffTheirSurface) {
  // Far from the origin, where single precision is coarse.
  const Vec3 far(1000, -2000, 500);
  const LightTable table = table_of([&](LightTable& t) {
    EmissiveFacet facet = facet_of(true, true, 0);
    facet.corner += far;
    t.facets.add(facet);
    t.spheres.add({far + Vec3(9, 0, 0), 0.5f, kColor, false, true, 0});
  });
  const PhotonEmission emission = emission_of(table, {kEverything});
  const EmissiveFacet facet = facet_of(true, true, 0);
  const Vec3d n = glm::normalize(glm::cross(Vec3d(facet.edge1), Vec3d(facet.edge2)));
  for_each_photon(emission, 69, [&](const PhotonRay& ray, const Vec3d&, std::uint32_t light) {
    if (light == 0) {
      const double above = glm::dot(ray.origin - Vec3d(facet.corner) - Vec3d(far), n);
      ASSERT_GT(above * glm::dot(ray.direction, n), 0);
      ASSERT_NEAR(above, 0, 0.02);
    } else {
      const Vec3d from_center = ray.origin - Vec3d(far + Vec3(9, 0, 0));
      ASSERT_EQ(glm::length(from_center) > 0.5, glm::dot(from_center, ray.direction) > 0);
      ASSERT_NEAR(glm::length(from_center), 0.5, 0.05);
    }
  });
}

}  // namespace
}  // namespace lightmill::test
