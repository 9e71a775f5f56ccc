// Sheen over principled surfaces. The threshold of chi-squared tests raises a false alarm once in 3.5 million tests.
#include <array>

#include "tests/analytic/materials/principled_parameters.h"
#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {
namespace {

/// White sheen over nothing.
Parameters fibres(float roughness) {
  return {.base_color = Vec3(0), .specular = 0, .sheen_color = Vec3(1), .sheen_roughness = roughness};
}

std::vector<Parameters> cloths() {
  std::vector<Parameters> all{fibres(0.5f), fibres(1)};
  for (const float roughness : {0.15f, 0.4f, 1.0f}) {
    all.push_back({.base_color = Vec3(1), .sheen_color = Vec3(1), .sheen_roughness = roughness});
    all.push_back({.base_color = Vec3(1),
                   .metallic = 1,
                   .roughness = 0.6f,
                   .sheen_color = {0.4f, 0.9f, 0.2f},
                   .sheen_roughness = roughness});
    all.push_back({.metallic = 0.3f,
                   .roughness = 0.4f,
                   .transmission = 0.5f,
                   .coat = 0.7f,
                   .coat_roughness = 0.3f,
                   .sheen_color = Vec3(0.8f),
                   .sheen_roughness = roughness});
  }
  return all;
}

TEST(Sheen, EvaluatesThePublishedFormula) {
  for (const float roughness : {0.3f, 0.5f, 0.75f, 1.0f}) {
    for (int i = 0; i < 500; ++i) {
      const double z = ((i % 31) + 0.5) / 31, r = std::sqrt(1 - z * z), phi = i * 2.399963;
      const Vec3d wo = tilted(89.0 * (i % 23) / 23), wi(r * std::cos(phi), r * std::sin(phi), z);
      const double exact = sheen_formula(roughness, upright(wo), upright(wi));
      const Principled8 bsdf = fibres(roughness).seen_from(to_lanes(wo));
      ASSERT_NEAR(Lanes(bsdf.eval(to_lanes(wo), to_lanes(wi)).x)[0], exact, 1e-3 * exact + 1e-6)
          << roughness << " " << i;
    }
  }
}

TEST(Sheen, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 6000;
  for (const Parameters& p : cloths()) {
    for (const double degrees : kPrincipledAngles) {
      const Vec3d wo = tilted(degrees);
      EXPECT_LT(sample_z(p.seen_from(to_lanes(wo)), wo, grid_for(p, wo, p.ior), ++seed, 1e-2), kChiSquaredThreshold)
          << seed << " " << degrees;
    }
  }
}

TEST(Sheen, IsReciprocal) {
  for (const Parameters& p : cloths()) {
    expect_reciprocity([&](const V8& wo, M8 front) { return p.seen_from(wo, front); }, p.ior, p.transmission > 0, 1e-2);
  }
}

/// Share of even light that is reflected to wo, by quadrature that is finest near the horizon.
double albedo_of(const Parameters& p, const Vec3d& wo) {
  constexpr int kSteps = 128;
  const Principled8 bsdf = p.seen_from(to_lanes(wo));
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const float root = (static_cast<float>(i) + 0.5f) / kSteps, z = root * root, r = std::sqrt(1 - z * z);
    for (int j = 0; j < kSteps; j += 8) {
      const F8 turn = (to_float(U8(static_cast<std::uint32_t>(j)) + U8::lane_index()) + F8(0.5f)) * F8(1.0f / kSteps);
      const SinCos8 phi = sin_cos_turns(turn);
      const Lanes f(bsdf.eval(to_lanes(wo), {phi.cos * F8(r), phi.sin * F8(r), F8(z)}).y);
      for (int lane = 0; lane < 8; ++lane) {
        sum += double{f[lane]} * 2 * root * 2 * M_PI / (kSteps * kSteps);
      }
    }
  }
  return sum;
}

TEST(Sheen, TabulatedAlbedosAreIntegrals) {
  for (const float roughness : {0.1f, 0.15f, 0.22f, 0.35f, 0.6f, 0.9f, 1.0f}) {
    double mean = 0;
    constexpr int kDirections = 24;
    for (int i = 0; i < kDirections; ++i) {
      const double root = (i + 0.5) / kDirections, z = root * root;
      const Vec3d wo(std::sqrt(1 - z * z), 0, z);
      const double albedo = albedo_of(fibres(roughness), wo);
      const double interpolation = z < 0.02 ? 0.015 : 5e-3;
      EXPECT_NEAR(Lanes(sheen::albedo(F8(static_cast<float>(z)), F8(roughness)))[0], albedo, interpolation)
          << roughness << " " << z;
      mean += albedo * 4 * root * z / kDirections;
    }
    EXPECT_NEAR(Lanes(sheen::mean_albedo(F8(roughness)))[0], mean, 3e-3) << roughness;
  }
}

TEST(Sheen, ReflectsNoMoreThanArrives) {
  for (const float roughness : {0.1f, 0.13f, 0.2f, 0.25f, 0.3f, 0.5f, 1.0f}) {
    for (const double degrees : {0.01, 60.0, 80.0, 85.0, 88.0, 89.5}) {
      EXPECT_LE(albedo_of(fibres(roughness), tilted(degrees)), 1.01) << roughness << " " << degrees;
    }
  }
}

TEST(Sheen, WhiteDiffuseSurfacesAndPlasticLoseNothingBelowIt) {
  for (const float roughness : {0.1f, 0.2f, 0.3f, 0.5f, 0.8f, 1.0f}) {
    for (const float amount : {0.4f, 1.0f}) {
      for (const double degrees : {0.01, 40.0, 60.0, 75.0, 85.0, 89.0}) {
        Parameters cloth{
            .base_color = Vec3(1), .specular = 0, .sheen_color = Vec3(amount), .sheen_roughness = roughness};
        EXPECT_NEAR(albedo_of(cloth, tilted(degrees)), 1, 0.01) << roughness << " " << amount << " at " << degrees;
        cloth.specular = 0.5f;
        cloth.roughness = 0.7f;
        EXPECT_NEAR(albedo_of(cloth, tilted(degrees)), 1, 0.01) << roughness << " " << amount << " at " << degrees;
      }
    }
  }
}

TEST(Sheen, WhiteMetalLosesLittleBelowIt) {
  for (const float roughness : {0.1f, 0.2f, 0.3f, 0.5f, 0.8f, 1.0f}) {
    for (const float below : {0.0f, 0.1f, 0.3f, 0.5f, 0.7f, 1.0f}) {
      for (const double degrees : {0.01, 40.0, 60.0, 75.0, 85.0}) {
        const Parameters p{.base_color = Vec3(1),
                           .metallic = 1,
                           .roughness = below,
                           .sheen_color = Vec3(1),
                           .sheen_roughness = roughness};
        const Vec3d wo = tilted(degrees);
        EXPECT_NEAR(even_albedo(p.seen_from(to_lanes(wo)), wo), 1, 0.045)
            << roughness << " over " << below << " at " << degrees;
      }
    }
  }
}

/// Surfaces without sheen have the same bits beside others in other lanes.
TEST(Sheen, DoesNotChangeOtherLanes) {
  const M8 plain = first_lanes(3);
  const auto same_bits = [&](F8 a, F8 b) { return (and_not(plain, float_bits(a) == float_bits(b))).none(); };
  for (const Parameters& p : cloths()) {
    const V8 wo = to_lanes(tilted(50)), wi = to_lanes(mirrored(tilted(40)));
    Parameters without = p;
    without.sheen_color = Vec3(0);
    PrincipledParameters8 mixed = p.in_lanes();
    mixed.sheen->color = masked(~plain, mixed.sheen->color);
    const Principled8 a = without.seen_from(wo), b(mixed, F8(p.ior), wo, M8(true));
    EXPECT_TRUE(same_bits(a.eval(wo, wi).y, b.eval(wo, wi).y));
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

TEST(Sheen, GlassHasNone) {
  const Parameters clear{.base_color = Vec3(1), .roughness = 0.4f, .transmission = 1};
  Parameters covered = clear;
  covered.sheen_color = Vec3(1);
  const V8 wo = to_lanes(tilted(70));
  for (const Vec3d& wi : {mirrored(tilted(60)), -tilted(30)}) {
    EXPECT_EQ(Lanes(clear.seen_from(wo).eval(wo, to_lanes(wi)).x)[0],
              Lanes(covered.seen_from(wo).eval(wo, to_lanes(wi)).x)[0]);
  }
}

}  // namespace
}  // namespace lightmill::test
