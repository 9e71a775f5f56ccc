// The principled material, with 100,000 draws each. The threshold raises a false alarm once in 3.5 million tests.
#include "common/materials/conductor.h"
#include "common/materials/diffuse.h"
#include "tests/analytic/materials/principled_parameters.h"

namespace lightmill::test {
namespace {

/// Every part alone and all of them together, rough and sharp.
std::vector<Parameters> many() {
  std::vector<Parameters> all;
  for (const float roughness : {0.2f, 0.5f, 1.0f}) {
    all.push_back({.roughness = roughness});
    all.push_back({.base_color = Vec3(1), .roughness = roughness});
    all.push_back({.base_color = Vec3(1), .roughness = roughness, .specular = 1, .ior = 2});
    all.push_back({.base_color = Vec3(0.5f), .roughness = roughness, .ior = 2, .specular_color = {0, 0.4f, 1}});
    all.push_back({.base_color = Vec3(0.5f), .roughness = roughness, .ior = 5, .specular_color = {0, 0.4f, 1}});
    all.push_back({.roughness = roughness, .specular = 0.747f, .ior = 10, .specular_color = {0.04f, 0, 1}});
    all.push_back({.base_color = {1, 1, 1}, .metallic = 1, .roughness = roughness});
    all.push_back({.base_color = {0.9f, 0.6f, 0.3f}, .metallic = 0.5f, .roughness = roughness});
    all.push_back({.base_color = Vec3(1), .roughness = roughness, .transmission = 1});
    all.push_back({.base_color = Vec3(1), .roughness = roughness, .coat = 1, .coat_roughness = 0.3f});
    all.push_back({.base_color = Vec3(1), .roughness = roughness, .transmission = 1, .coat = 1, .coat_roughness = 1});
    all.push_back({.base_color = {0.5f, 0.9f, 0.7f},
                   .metallic = 0.3f,
                   .roughness = roughness,
                   .specular = 0.8f,
                   .transmission = 0.4f,
                   .ior = 1.3f,
                   .coat = 0.6f,
                   .coat_roughness = 0.5f});
  }
  return all;
}

TEST(Principled, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 700;
  for (const Parameters& p : many()) {
    for (const double degrees : kPrincipledAngles) {
      const Vec3d wo = tilted(degrees);
      const Principled8 bsdf = p.seen_from(to_lanes(wo));
      EXPECT_LT(sample_z(bsdf, wo, grid_for(p, wo, p.ior), ++seed, 1e-2), kChiSquaredThreshold)
          << seed << " " << degrees;
    }
  }
}

TEST(Principled, ConservesEnergyOnBothSides) {
  std::uint32_t seed = 1000;
  for (const Parameters& p : many()) {
    for (const double degrees : kPrincipledAngles) {
      for (const bool front : {true, false}) {
        const Vec3d wo = tilted(degrees);
        const double eta = front ? p.ior : 1 / p.ior;
        const Principled8 bsdf = p.seen_from(to_lanes(wo), M8(front));
        const Albedo a = directional_albedo(bsdf, wo, grid_for(p, wo, eta), ++seed, eta);
        EXPECT_NEAR(a.by_sampling, a.by_quadrature, 5 * a.standard_error + 5e-3) << seed << " " << degrees;
        const double tables = p.metallic > 0 || p.transmission > 0 || p.coat > 0 ? 0.01 : 0;  // interpolation
        EXPECT_LE(a.by_sampling, 1 + tables + 5 * a.standard_error) << seed << " " << degrees;
        EXPECT_LE(a.by_quadrature, 1.002 + tables) << seed << " " << degrees;
      }
    }
  }
}

TEST(Principled, WhitePlasticReflectsAll) {
  for (const float roughness : {0.0f, 0.3f, 0.6f, 1.0f}) {
    const Parameters p{.base_color = Vec3(1), .roughness = roughness};
    for (const double degrees : kPrincipledAngles) {
      const Vec3d wo = tilted(degrees);
      const Albedo a = directional_albedo(p.seen_from(to_lanes(wo)), wo, Grid(mirrored(wo), -wo, 0.3), 3);
      EXPECT_NEAR(a.by_sampling, 1, 5 * a.standard_error + 4e-3) << roughness << " " << degrees;
    }
  }
}

TEST(Principled, WhiteMetalGlassAndCoatedSurfacesLoseNothing) {
  for (const float roughness : {0.1f, 0.3f, 0.5f, 0.7f, 1.0f}) {
    std::vector<Parameters> all{{.base_color = Vec3(1), .metallic = 1, .roughness = roughness},
                                {.base_color = Vec3(1), .metallic = 0.5f, .roughness = roughness},
                                {.base_color = Vec3(1), .roughness = roughness, .transmission = 1},
                                {.base_color = Vec3(1), .roughness = roughness, .transmission = 0.5f}};
    for (const float coat_roughness : {0.0f, 0.1f, 0.5f, 1.0f}) {
      for (const float metallic : {0.0f, 0.5f, 1.0f}) {
        all.push_back({.base_color = Vec3(1),
                       .metallic = metallic,
                       .roughness = roughness,
                       .coat = coat_roughness == 0.5f ? 0.5f : 1,
                       .coat_roughness = coat_roughness});
      }
    }
    for (const Parameters& p : all) {
      for (const double degrees : {0.01, 40.0, 60.0, 75.0, 85.0, 89.0}) {
        const Vec3d wo = tilted(degrees);
        EXPECT_NEAR(even_albedo(p.seen_from(to_lanes(wo)), wo, p.ior), 1, p.coat > 0 ? 0.02 : 0.012)
            << p.metallic << " " << p.roughness << " " << p.transmission << " " << p.coat << " " << p.coat_roughness
            << " at " << degrees;
      }
    }
  }
}

TEST(Principled, CoatedGlassLosesLittleOnEitherSide) {
  for (const float roughness : {0.0f, 0.3f, 0.6f}) {
    for (const float coat_roughness : {0.0f, 0.3f}) {
      const Parameters p{.base_color = Vec3(1),
                         .roughness = roughness,
                         .transmission = 1,
                         .coat = 1,
                         .coat_roughness = coat_roughness};
      for (const double degrees : {0.01, 40.0, 60.0, 75.0}) {
        for (const bool front : {true, false}) {
          const Vec3d wo = tilted(degrees);
          EXPECT_NEAR(even_albedo(p.seen_from(to_lanes(wo), M8(front)), wo, front ? p.ior : 1 / p.ior), 1, 0.02)
              << roughness << " " << coat_roughness << " " << front << " at " << degrees;
        }
      }
    }
  }
}

TEST(Principled, IsReciprocal) {
  for (const Parameters& p : many()) {
    expect_reciprocity([&](const V8& wo, M8 front) { return p.seen_from(wo, front); }, p.ior, p.transmission > 0, 1e-2);
  }
}

/// Both BSDFs agree in 500 directions, on both sides if `transmits`.
template <class Bsdf>
void expect_same(const Parameters& p, const Bsdf& other, bool transmits, double tolerance) {
  for (int i = 0; i < 500; ++i) {
    const Vec3d wo = tilted(89.0 * (i % 23) / 23);
    const double z = 1 - 1.98 * ((i % 31) + 0.5) / 31, r = std::sqrt(1 - z * z), phi = i * 2.399963;
    const Vec3d wi(r * std::cos(phi), r * std::sin(phi), transmits ? z : std::abs(z));
    const Principled8 bsdf = p.seen_from(to_lanes(wo));
    const double a = Lanes(bsdf.eval(to_lanes(wo), to_lanes(wi)).x)[0];
    const double b = Lanes(other.eval(to_lanes(wo), to_lanes(wi)).x)[0];
    ASSERT_NEAR(a, b, tolerance * std::max(a, b) + 1e-6) << i;
  }
}

TEST(Principled, WithoutGlossItIsLambert) {
  expect_same({.specular = 0}, Diffuse8{broadcast(Vec3(0.8f))}, false, 1e-6);
  expect_same({.ior = 1}, Diffuse8{broadcast(Vec3(0.8f))}, false, 1e-6);
}

/// Burley's diffuse part alone and below layers.
std::vector<Parameters> with_burley() {
  std::vector<Parameters> all;
  for (const float roughness : {0.2f, 0.5f, 1.0f}) {
    all.push_back({.roughness = roughness, .specular = 0, .burley = true});
    all.push_back({.roughness = roughness, .burley = true});
    all.push_back({.metallic = 0.3f, .roughness = roughness, .transmission = 0.4f, .coat = 0.6f, .burley = true});
  }
  return all;
}

/// f · cos of a white surface, as Burley writes it (2012, 5.3), with the angle between the half vector and wi.
double published_burley(const Vec3d& wo, const Vec3d& wi, double roughness) {
  const double cos_d = glm::dot(glm::normalize(wo + wi), wi), f90 = 0.5 + 2 * roughness * cos_d * cos_d;
  const auto schlick = [&](double cosine) { return 1 + (f90 - 1) * std::pow(1 - cosine, 5); };
  return schlick(wo.z) * schlick(wi.z) * wi.z / M_PI;
}

TEST(Principled, BurleysDiffusePartIsThePublishedOne) {
  for (const float roughness : {0.0f, 0.4f, 1.0f}) {
    const Parameters p{.base_color = Vec3(1), .roughness = roughness, .specular = 0, .burley = true};
    for (const double degrees : kPrincipledAngles) {
      const Vec3d wo = tilted(degrees);
      const Principled8 bsdf = p.seen_from(to_lanes(wo));
      double albedo = 0;
      constexpr int kSteps = 200;
      for (int i = 0; i < kSteps * kSteps; ++i) {
        const double z = (i / kSteps + 0.5) / kSteps, phi = M_PI * (i % kSteps + 0.5) / kSteps,
                     r = std::sqrt(1 - z * z);
        const Vec3d wi(r * std::cos(phi), r * std::sin(phi), z);
        const double f = published_burley(wo, wi, roughness);
        albedo += f * 2 * M_PI / (kSteps * kSteps);
        if (i % 100 == 0) {
          ASSERT_NEAR(Lanes(bsdf.eval(to_lanes(wo), to_lanes(wi)).x)[0], f, 1e-5 * f + 1e-6) << degrees << " " << i;
        }
      }
      EXPECT_NEAR(Lanes(bsdf.rough_albedo().x)[0], albedo, 1e-4) << roughness << " " << degrees;
      EXPECT_NEAR(even_albedo(bsdf, wo), albedo, 2e-3) << roughness << " " << degrees;
    }
  }
}

TEST(Principled, BurleysDiffusePartIsSampledAndReciprocal) {
  std::uint32_t seed = 2000;
  for (const Parameters& p : with_burley()) {
    for (const double degrees : {40.0, 88.0}) {
      const Vec3d wo = tilted(degrees);
      EXPECT_LT(sample_z(p.seen_from(to_lanes(wo)), wo, grid_for(p, wo, p.ior), ++seed, 1e-2), kChiSquaredThreshold)
          << seed << " " << degrees;
    }
    expect_reciprocity([&](const V8& wo, M8 front) { return p.seen_from(wo, front); }, p.ior, p.transmission > 0, 1e-2);
  }
}

TEST(Principled, GlossTakesNoLightFromBurleysDiffusePart) {
  const Parameters all{.roughness = 0.5f, .burley = true};
  Parameters gloss = all, diffuse = all;
  gloss.base_color = Vec3(0);
  diffuse.specular = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3d wo = tilted(89.0 * (i % 23) / 23);
    const double z = ((i % 31) + 0.5) / 31, r = std::sqrt(1 - z * z), phi = i * 2.399963;
    const V8 wi = to_lanes({r * std::cos(phi), r * std::sin(phi), z});
    const auto f = [&](const Parameters& p) { return Lanes(p.seen_from(to_lanes(wo)).eval(to_lanes(wo), wi).x)[0]; };
    ASSERT_NEAR(f(all), f(gloss) + f(diffuse), 1e-5 * f(all)) << i;
  }
}

TEST(Principled, WhiteMetalIsAConductorThatReflectsAll) {
  for (const bool compensated : {false, true}) {
    expect_same({.base_color = Vec3(1), .metallic = 1, .roughness = 0.6f, .compensated = compensated},
                Conductor8{broadcast(Vec3(1)), broadcast(Vec3(1e5f)), F8(0.36f), broadcast(Vec3(compensated ? 1 : 0))},
                false, 1e-3);
  }
}

TEST(Principled, ClearGlassIsADielectric) {
  for (const bool compensated : {false, true}) {
    expect_same({.base_color = Vec3(1), .roughness = 0.6f, .transmission = 1, .ior = 1.4f, .compensated = compensated},
                RoughDielectric8{.eta = F8(1.4f), .alpha = F8(0.36f), .compensated = M8(compensated)}, true, 1e-4);
  }
}

TEST(Principled, SmoothLobesAreDrawnAsDeltas) {
  // Smooth gold shows its base colour at normal incidence.
  const V8 up = to_lanes({0, 0, 1});
  const Parameters gold{.base_color = {1, 0.7f, 0.3f}, .metallic = 1, .roughness = 0};
  const BsdfSample8 s = gold.seen_from(up).sample(up, {F8(0.3f), F8(0.6f)}, F8(0.5f));
  EXPECT_EQ(Lanes(s.pdf_solid_angle)[0], 0);
  EXPECT_NEAR(Lanes(s.weight.y)[0], 0.7, 1e-5);
  // Smooth glass splits light by Fresnel's equations, whatever the probabilities of the draws.
  const Vec3d wo = tilted(60);
  const Principled8 glass =
      Parameters{.base_color = Vec3(1), .roughness = 0, .transmission = 1}.seen_from(to_lanes(wo));
  double reflected = 0, refracted = 0;
  for_each_sample(glass, to_lanes(wo), 5, [&](const BsdfSample8& sample) {
    const Lanes weight(sample.weight.x);
    for (int i = 0; i < 8; ++i) {
      ((sample.transmitted.bits() >> i & 1) != 0 ? refracted : reflected) += weight[i] / kDraws;
    }
  });
  EXPECT_NEAR(reflected, 0.0891867, 5 * std::sqrt(0.0891867 / kDraws));
  EXPECT_NEAR(refracted * 2.25, 1 - 0.0891867, 5 * std::sqrt(0.0891867 / kDraws));
}

/// Reflectances of a dielectric with index 1.5 by Fresnel's equations.
constexpr std::pair<double, double> kFresnel[] = {
    {0, 0.04}, {45, 0.0502399}, {60, 0.0891867}, {75, 0.2530606}, {85, 0.6127996}};

/// What a smooth surface with a black base reflects.
double black_reflects(Parameters p, double degrees) {
  p.base_color = Vec3(0);
  const V8 wo = to_lanes(tilted(degrees));
  return Lanes(p.seen_from(wo).smooth(wo, {F8(0.0f), F8(0.0f)}).reflected.y)[0];
}

TEST(Principled, GlossAndCoatReflectByFresnelsEquations) {
  for (const auto& [degrees, reflectance] : kFresnel) {
    EXPECT_NEAR(black_reflects({.roughness = 0}, degrees), reflectance, 2e-6) << degrees;
    EXPECT_NEAR(black_reflects({.roughness = 0, .specular = 0.2f}, degrees), 0.4 * reflectance, 2e-6) << degrees;
    EXPECT_NEAR(black_reflects({.roughness = 0, .ior = 1 / 1.5f}, degrees), reflectance, 2e-6) << degrees;
    EXPECT_NEAR(black_reflects({.roughness = 0, .specular = 0, .coat = 1, .coat_roughness = 0}, degrees), reflectance,
                2e-6)
        << degrees;
    // `specular` 1 doubles the reflectance at normal incidence, as this index does.
    EXPECT_NEAR(black_reflects({.roughness = 0, .specular = 0.5f, .ior = 1.7887886f}, degrees),
                black_reflects({.roughness = 0, .specular = 1}, degrees), 2e-6)
        << degrees;
  }
  EXPECT_NEAR(black_reflects({.roughness = 0, .specular = 1}, 0), 0.08, 1e-6);
  EXPECT_EQ(black_reflects({.roughness = 0, .ior = 1}, 60), 0);
}

TEST(Principled, ColouredGlossIsWhiteAtGrazingAngles) {
  // F − (1 − c) f0 (1 − w), with Schlick's w = (1 − cos)⁵. Never negative: indices above 3.7 have a minimum of F.
  for (const auto& [degrees, reflectance] : kFresnel) {
    const double rest = 1 - std::pow(1 - std::cos(degrees * M_PI / 180), 5);
    for (const float color : {0.0f, 0.3f, 1.0f}) {
      const Parameters p{.roughness = 0, .specular_color = {1, color, 1}};
      EXPECT_NEAR(black_reflects(p, degrees), reflectance - (1 - color) * 0.04 * rest, 2e-6) << degrees << " " << color;
      const Parameters mirror{.roughness = 0, .specular = 0.747f, .ior = 10, .specular_color = {1, color, 1}};
      EXPECT_GE(black_reflects(mirror, degrees), 0.98 * color) << degrees;
      EXPECT_LE(black_reflects(mirror, degrees), 1) << degrees;
    }
  }
}

TEST(Principled, ColouredGlossHasTheAlbedoThatItStates) {
  for (const float ior : {2.0f, 4.0f, 10.0f}) {
    for (const float roughness : {0.3f, 0.7f, 1.0f}) {
      for (const double degrees : {10.0, 50.0, 80.0}) {
        const Vec3d wo = tilted(degrees);
        const Parameters p{.base_color = Vec3(0), .roughness = roughness, .ior = ior, .specular_color = Vec3(0.25f)};
        const Principled8 bsdf = p.seen_from(to_lanes(wo));
        const Albedo a = directional_albedo(bsdf, wo, grid_for(p, wo, 2), 11);
        EXPECT_NEAR(Lanes(bsdf.rough_albedo().x)[0], a.by_sampling, 5 * a.standard_error + 4e-3)
            << ior << " " << roughness << " " << degrees;
      }
    }
  }
}

TEST(GgxAlbedo, IsWhatGlossReflects) {
  EXPECT_NEAR(Lanes(ggx::coat_albedo(F8(0.4f), F8(0.3f)))[0],
              Lanes(ggx::gloss_albedo(F8(0.4f), F8(0.3f), F8(ggx::kCoatEta)))[0], 1e-6);
  for (const float eta : {1.1f, 1.5f, 1.8f, 4.0f, 8.0f, 20.0f, 34.0f, 100.0f}) {
    for (const double alpha : {0.0, 0.0004, 0.01, 0.0625, 0.2, 0.37, 0.6, 0.9, 1.0}) {
      const auto roughness = static_cast<float>(std::sqrt(alpha));
      for (const double degrees : {0.01, 25.0, 45.0, 65.0, 80.0, 87.0}) {
        const Vec3d wo = tilted(degrees);
        const Principled8 black =
            Parameters{.base_color = Vec3(0), .roughness = roughness, .ior = eta}.seen_from(to_lanes(wo));
        const Albedo a = directional_albedo(black, wo, Grid(mirrored(wo), -wo, 2 * alpha), 9);
        const F8 cosine(static_cast<float>(wo.z));
        const double table = Lanes(ggx::gloss_albedo(cosine, F8(static_cast<float>(alpha)), F8(eta)))[0];
        const double tolerance = eta > 40 ? 0.09 : eta > 10 ? 0.012 : degrees > 80 || eta > 1.8f ? 4.5e-3 : 1e-3;
        EXPECT_NEAR(table, a.by_sampling, 5 * a.standard_error + tolerance) << eta << " " << alpha << " " << degrees;
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
