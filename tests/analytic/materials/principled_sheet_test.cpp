// Principled sheets, which transmit diffuse light. The threshold of chi-squared tests raises a false alarm once in 3.5
// million tests.
#include <array>

#include "tests/analytic/materials/principled_parameters.h"

namespace lightmill::test {
namespace {

constexpr std::array kSides{true, false};

std::vector<Parameters> sheets() {
  std::vector<Parameters> all;
  for (const bool closed : {false, true}) {
    for (const float roughness : {0.2f, 0.6f}) {
      all.push_back({.roughness = roughness, .transmittance = Vec3(1), .closed = closed});
      all.push_back(
          {.base_color = Vec3(1), .roughness = roughness, .transmittance = {0.2f, 0.4f, 0.9f}, .closed = closed});
      all.push_back({.roughness = roughness, .burley = true, .transmittance = Vec3(0.7f), .closed = closed});
    }
    all.push_back({.base_color = {0.9f, 0.6f, 0.3f},
                   .metallic = 0.3f,
                   .roughness = 0.5f,
                   .specular = 1,
                   .ior = 2,
                   .coat = 0.7f,
                   .coat_roughness = 0.3f,
                   .anisotropy = 0.5f,
                   .sheen_color = {0.2f, 0.5f, 0.8f},
                   .transmittance = Vec3(0.6f),
                   .closed = closed});
    all.push_back({.base_color = Vec3(0.9f),
                   .roughness = 0.5f,
                   .transmission = 0.5f,
                   .ior = 1.3f,
                   .coat = 0.5f,
                   .coat_roughness = 0.4f,
                   .transmittance = Vec3(0.6f),
                   .closed = closed});
  }
  return all;
}

/// Without glass there is no refraction.
double eta_of(const Parameters& p, bool front) {
  return p.transmission == 0 ? 1 : front ? p.ior : 1 / p.ior;
}

Principled8 seen(const Parameters& p, const V8& wo, M8 front) {
  const auto eta = [&](bool side) { return F8(static_cast<float>(eta_of(p, side))); };
  return {p.in_lanes(), select(front, eta(true), eta(false)), wo, front};
}

TEST(PrincipledSheet, SamplesFollowThePdf) {
  std::uint32_t seed = 7000;
  for (const Parameters& p : sheets()) {
    for (const double degrees : kPrincipledAngles) {
      for (const bool front : kSides) {
        const Vec3d wo = tilted(degrees);
        EXPECT_LT(sample_z(seen(p, to_lanes(wo), M8(front)), wo, grid_for(p, wo, eta_of(p, front)), ++seed, 1e-2),
                  kChiSquaredThreshold)
            << seed << " " << degrees;
      }
    }
  }
}

TEST(PrincipledSheet, SamplesCarryTheIntegral) {
  std::uint32_t seed = 7500;
  for (const Parameters& p : sheets()) {
    for (const double degrees : kPrincipledAngles) {
      for (const bool front : kSides) {
        const Vec3d wo = tilted(degrees);
        const double eta = eta_of(p, front);
        const Albedo a = directional_albedo(seen(p, to_lanes(wo), M8(front)), wo, grid_for(p, wo, eta), ++seed, eta);
        EXPECT_NEAR(a.by_sampling, a.by_quadrature, 5 * a.standard_error + 5e-3) << seed << " " << degrees;
      }
    }
  }
}

TEST(PrincipledSheet, IsReciprocal) {
  for (const Parameters& p : sheets()) {
    // The sheet's lobe carries no eta² and is tested without glass.
    if (p.transmission == 0) {
      expect_reciprocity([&](const V8& wo, M8 front) { return seen(p, wo, front); }, 1, true, 1e-2);
    }
  }
}

TEST(PrincipledSheet, WhiteThinSheetsLoseNothing) {
  for (const float roughness : {0.1f, 0.3f, 0.6f, 1.0f}) {
    for (const float specular : {0.0f, 0.5f, 1.0f}) {
      for (const float coat : {0.0f, 1.0f}) {
        for (const float transmittance : {0.3f, 1.0f}) {
          const Parameters p{.base_color = Vec3(1),
                             .roughness = roughness,
                             .specular = specular,
                             .coat = coat,
                             .sheen_color = Vec3(coat == 0 ? 0 : 0.5f),
                             .transmittance = Vec3(transmittance)};
          for (const double degrees : {0.01, 40.0, 60.0, 75.0, 85.0}) {
            const Vec3d wo = tilted(degrees);
            EXPECT_NEAR(even_albedo(seen(p, to_lanes(wo), M8(true)), wo), 1, coat == 0 ? 0.012 : 0.025)
                << roughness << " " << specular << " " << coat << " " << transmittance << " at " << degrees;
          }
        }
      }
    }
  }
}

/// Both ways across a surface around a medium: light that enters from wi and leaves to wo, over τ²/π² cos cos, is what
/// the diffuse part is over base/π cos, if the medium returns all.
TEST(PrincipledSheet, EnteringAndLeavingScaleLightAsTheDiffusePartDoes) {
  for (const float roughness : {0.2f, 0.7f}) {
    for (const float coat : {0.0f, 0.8f}) {
      const Parameters diffuse{.base_color = Vec3(1),
                               .roughness = roughness,
                               .specular = 1,
                               .ior = 1.8f,
                               .coat = coat,
                               .sheen_color = Vec3(0.4f)};
      Parameters sheet = diffuse;
      sheet.transmittance = Vec3(1);
      sheet.closed = true;
      const Vec3d inside(0.3, -0.2, std::sqrt(1 - 0.13));
      for (const double from : kPrincipledAngles) {
        for (const double to : kPrincipledAngles) {
          const V8 wo = to_lanes(tilted(from)), wi = to_lanes(mirrored(tilted(to)));
          const V8 down = to_lanes(-inside), out = to_lanes(-mirrored(tilted(to)));
          const double enters = Lanes(seen(sheet, wo, M8(true)).eval(wo, down).x)[0] * M_PI / inside.z;
          const double leaves = Lanes(seen(sheet, to_lanes(inside), M8(false)).eval(to_lanes(inside), out).x)[0];
          // Everything of the plain material, less its reflections, which a black base shows.
          Parameters black = diffuse;
          black.base_color = Vec3(0);
          const double all = Lanes(seen(diffuse, wo, M8(true)).eval(wo, wi).x)[0];
          const double both = all - Lanes(seen(black, wo, M8(true)).eval(wo, wi).x)[0];
          EXPECT_NEAR(enters * leaves, both, 2e-3 * both + 1e-5 * all + 1e-6) << from << " " << to;
        }
      }
    }
  }
}

TEST(PrincipledSheet, TheInsideOfAMediumIsThatOfADiffuseSheet) {
  // Without layers above it, and with metal and gloss that the inside does not show.
  const Parameters p{.base_color = Vec3(0.5f), .specular = 0, .transmittance = Vec3(0.75f), .closed = true};
  const Parameters glossy{.base_color = Vec3(0.5f),
                          .roughness = 0,
                          .specular = 1,
                          .coat = 1,
                          .coat_roughness = 0,
                          .sheen_color = Vec3(1),
                          .transmittance = Vec3(0.75f),
                          .closed = true};
  for (const double degrees : kPrincipledAngles) {
    const Vec3d wo = tilted(degrees);
    for (const Vec3d& wi : {tilted(20), tilted(80), -tilted(50)}) {
      const double share = wi.z > 0 ? 0.5 * 0.25 : 0.75;
      EXPECT_NEAR(Lanes(seen(p, to_lanes(wo), M8(false)).eval(to_lanes(wo), to_lanes(wi)).x)[0],
                  share * std::abs(wi.z) / M_PI, 1e-5);
      if (wi.z > 0) {
        EXPECT_NEAR(Lanes(seen(glossy, to_lanes(wo), M8(false)).eval(to_lanes(wo), to_lanes(wi)).x)[0],
                    share * wi.z / M_PI, 1e-5);
      }
    }
    const DeltaLobes8 smooth =
        seen(glossy, to_lanes(wo), M8(false)).smooth(to_lanes(wo), dielectric::fresnel(F8(1.0f), F8(1.0f)));
    EXPECT_EQ(Lanes(smooth.reflected.x)[0], 0);
  }
}

TEST(PrincipledSheet, BurleysEntryAndExitArePublished) {
  // Cycles 3.4: 1 - F/2 at each end, and retro-reflection on the outside.
  const Parameters p{.base_color = Vec3(1),
                     .roughness = 0.7f,
                     .specular = 0,
                     .burley = true,
                     .transmittance = Vec3(1),
                     .closed = true};
  Parameters whole = p;
  whole.transmittance = Vec3(0);
  whole.closed = false;
  const auto left = [](double z) { return 1 - 0.5 * std::pow(1 - z, 5); };
  for (const double degrees : kPrincipledAngles) {
    const Vec3d wo = tilted(degrees), wi = mirrored(tilted(70));
    EXPECT_NEAR(Lanes(seen(p, to_lanes(wo), M8(true)).eval(to_lanes(wo), to_lanes(-wi)).x)[0], left(wo.z) * wi.z / M_PI,
                1e-5);
    EXPECT_NEAR(Lanes(seen(p, to_lanes(wo), M8(false)).eval(to_lanes(wo), to_lanes(-wi)).x)[0],
                left(wi.z) * wi.z / M_PI, 1e-5);
    EXPECT_NEAR(Lanes(seen(p, to_lanes(wo), M8(true)).eval(to_lanes(wo), to_lanes(wi)).x)[0],
                Lanes(seen(whole, to_lanes(wo), M8(true)).eval(to_lanes(wo), to_lanes(wi)).x)[0] -
                    left(wo.z) * left(wi.z) * wi.z / M_PI,
                1e-5);
  }
}

/// Surfaces without a transmittance have the same bits beside sheets in other lanes.
TEST(PrincipledSheet, DoesNotChangeOtherLanes) {
  const M8 plain = first_lanes(3);
  const auto same_bits = [&](F8 a, F8 b) { return (and_not(plain, float_bits(a) == float_bits(b))).none(); };
  for (const Parameters& p : sheets()) {
    for (const bool front : kSides) {
      const V8 wo = to_lanes(tilted(50)), wi = to_lanes(mirrored(tilted(40)));
      Parameters without = p;
      without.transmittance = Vec3(0);
      without.closed = false;
      PrincipledParameters8 alone = without.in_lanes(), mixed = p.in_lanes();
      alone.sheet.reset();
      mixed.sheet->transmittance = masked(~plain, mixed.sheet->transmittance);
      mixed.sheet->closed = and_not(mixed.sheet->closed, plain);
      const F8 eta(static_cast<float>(eta_of(p, front)));
      const Principled8 a(alone, eta, wo, M8(front)), b(mixed, eta, wo, M8(front));
      EXPECT_TRUE(same_bits(a.eval(wo, wi).y, b.eval(wo, wi).y));
      EXPECT_TRUE(same_bits(a.eval(wo, -wi).y, b.eval(wo, -wi).y));
      EXPECT_TRUE(same_bits(a.pdf_solid_angle(wo, wi), b.pdf_solid_angle(wo, wi)));
      EXPECT_TRUE(same_bits(a.rough_albedo().y, b.rough_albedo().y));
      for (const float choice : {0.05f, 0.5f, 0.95f}) {
        const BsdfSample8 s = a.sample(wo, {F8(0.37f), F8(0.61f)}, F8(choice)),
                          t = b.sample(wo, {F8(0.37f), F8(0.61f)}, F8(choice));
        EXPECT_TRUE(same_bits(s.wi.x, t.wi.x));
        EXPECT_TRUE(same_bits(s.weight.x, t.weight.x));
        EXPECT_TRUE(same_bits(s.pdf_solid_angle, t.pdf_solid_angle));
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
