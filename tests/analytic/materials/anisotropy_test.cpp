// Anisotropic metal and gloss. The threshold of chi-squared tests raises a false alarm once in 3.5 million tests.
#include <array>
#include <span>

#include <fmt/format.h>

#include "common/materials/conductor.h"
#include "tests/analytic/materials/principled_parameters.h"
#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {
namespace {

/// Roughness and strength.
constexpr std::array<std::pair<float, float>, 6> kSurfaces{
    {{0.3f, 0.2f}, {0.3f, 0.6f}, {0.5f, 0.5f}, {0.5f, 1.0f}, {0.8f, 0.7f}, {0.15f, 0.9f}}};
/// The lobes of the last one are too narrow, for their length, for the grids of chi-squared tests.
constexpr std::span kSampled = std::span(kSurfaces).first<5>();
constexpr std::array<double, 4> kAzimuths{0, 35, 62, 90};

Vec3d direction(double degrees, double azimuth) {
  const double theta = degrees * M_PI / 180, phi = azimuth * M_PI / 180;
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

Conductor8 white_metal(float roughness, float strength, bool compensated) {
  return {broadcast(Vec3(1)), broadcast(Vec3(1e5f)), ggx::Facets8(F8(roughness * roughness), F8(strength), M8(true)),
          broadcast(Vec3(compensated ? 1 : 0))};
}

/// The BRDF of white metal times the cosine, as KHR_materials_anisotropy writes it.
double published(double roughness, double strength, const Vec3d& wo, const Vec3d& wi) {
  const double ab = roughness * roughness, at = ab * (1 - strength * strength) + strength * strength;
  const Vec3d h = glm::normalize(wo + wi), f(ab * h.x, at * h.y, at * ab * h.z);
  const double w2 = at * ab / glm::dot(f, f), d = at * ab * w2 * w2 / M_PI;
  const auto length = [&](const Vec3d& w) { return glm::length(Vec3d(at * w.x, ab * w.y, w.z)); };
  return d * 0.5 / (wi.z * length(wo) + wo.z * length(wi)) * wi.z;
}

TEST(Anisotropy, EvaluatesThePublishedFormula) {
  for (const auto& [roughness, strength] : kSurfaces) {
    const Conductor8 metal = white_metal(roughness, strength, false);
    for (int i = 0; i < 500; ++i) {
      const Vec3d wo = direction(89.0 * (i % 23) / 23, 11.0 * i), wi = direction(89.0 * (i % 31) / 31, 137.5 * i);
      const double exact = published(roughness, strength, wo, wi);
      ASSERT_NEAR(Lanes(metal.eval(to_lanes(wo), to_lanes(wi)).x)[0], exact, 2e-3 * exact + 1e-6) << i;
    }
  }
}

TEST(Anisotropy, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 5000;
  for (const auto& [roughness, strength] : kSampled) {
    const double width = std::clamp(2.0 * roughness * roughness, 0.05, 0.3);
    for (const double degrees : {0.01, 45.0, 80.0}) {
      for (const double azimuth : kAzimuths) {
        const Vec3d wo = direction(degrees, azimuth);
        const Grid grid(mirrored(wo), -wo, width);
        EXPECT_LT(sample_z(white_metal(roughness, strength, true), wo, grid, ++seed, 1e-2), kChiSquaredThreshold)
            << roughness << " " << strength << " at " << degrees << " " << azimuth;
      }
    }
  }
}

std::vector<Parameters> principled_surfaces() {
  std::vector<Parameters> all;
  for (const auto& [roughness, strength] : kSampled) {
    all.push_back({.roughness = roughness, .anisotropy = strength});
    all.push_back({.metallic = 0.5f,
                   .roughness = roughness,
                   .transmission = 0.4f,
                   .coat = 0.6f,
                   .coat_roughness = 0.4f,
                   .anisotropy = strength});
  }
  return all;
}

TEST(Anisotropy, PrincipledSurfacesDrawWhatTheirPdfSays) {
  std::uint32_t seed = 5500;
  for (const Parameters& p : principled_surfaces()) {
    for (const auto& [degrees, azimuth] : {std::pair(30.0, 62.0), {75.0, 20.0}}) {
      const Vec3d wo = direction(degrees, azimuth);
      EXPECT_LT(sample_z(p.seen_from(to_lanes(wo)), wo, grid_for(p, wo, p.ior), ++seed, 1e-2), kChiSquaredThreshold)
          << p.roughness << " " << p.anisotropy << " at " << degrees;
    }
  }
}

TEST(Anisotropy, IsReciprocal) {
  for (const auto& [roughness, strength] : kSurfaces) {
    expect_reciprocity([&](const V8&, M8) { return white_metal(roughness, strength, true); }, 1, false, 1e-2);
  }
  for (const Parameters& p : principled_surfaces()) {
    expect_reciprocity([&](const V8& wo, M8 front) { return p.seen_from(wo, front); }, p.ior, p.transmission > 0, 1e-2);
  }
}

/// Calls `check(albedo, text)` for white surfaces made by `make(roughness, strength)`, seen from many directions.
template <class Make, class Check>
void for_each_albedo(Make make, Check check) {
  for (const float roughness : {0.1f, 0.23f, 0.4f, 0.6f, 0.8f}) {
    for (const float strength : {0.1f, 0.35f, 0.6f, 0.8f, 1.0f}) {
      for (const double degrees : {0.01, 40.0, 60.0, 75.0, 85.0, 89.0}) {
        for (const double azimuth : kAzimuths) {
          const Vec3d wo = direction(degrees, azimuth);
          check(even_albedo(make(roughness, strength, to_lanes(wo)), wo),
                fmt::format("{} {} at {} {}", roughness, strength, degrees, azimuth));
        }
      }
    }
  }
}

TEST(Anisotropy, WhiteMetalLosesNothing) {
  for_each_albedo([](float r, float s, const V8&) { return white_metal(r, s, true); },
                  [](double albedo, const std::string& which) { EXPECT_NEAR(albedo, 1, 0.015) << which; });
}

TEST(Anisotropy, WhitePlasticLosesNothing) {
  // The albedo of the gloss is a fit for other indices than 1.5.
  for (const auto& [ior, tolerance] : {std::pair(1.2f, 0.065), {1.5f, 0.015}, {2.0f, 0.02}, {4.0f, 0.08}}) {
    for_each_albedo(
        [&](float r, float s, const V8& wo) {
          return Parameters{.base_color = Vec3(1), .roughness = r, .ior = ior, .anisotropy = s}.seen_from(wo);
        },
        [&](double albedo, const std::string& which) { EXPECT_NEAR(albedo, 1, tolerance) << ior << " " << which; });
  }
}

/// The albedo of facets by the published formula, integrated over directions.
TEST(Anisotropy, TabulatedAlbedosAreIntegrals) {
  for (const auto& [roughness, strength] : {std::pair(0.5f, 0.5f), {0.6f, 0.9f}, {0.8f, 0.3f}}) {
    for (const double degrees : {10.0, 50.0, 75.0}) {
      for (const double azimuth : kAzimuths) {
        const Vec3d wo = direction(degrees, azimuth);
        constexpr int kSteps = 300;
        double white = 0, coat = 0;
        for (int i = 0; i < kSteps * kSteps; ++i) {
          const double z = (i / kSteps + 0.5) / kSteps, phi = 2 * M_PI * (i % kSteps + 0.5) / kSteps,
                       r = std::sqrt(1 - z * z);
          const Vec3d wi(r * std::cos(phi), r * std::sin(phi), z);
          const double f = published(roughness, strength, wo, wi) * 2 * M_PI / (kSteps * kSteps);
          white += f;
          coat += f * fresnel_formula(glm::dot(wo, glm::normalize(wo + wi)), 1.5);
        }
        const V8 w = to_lanes(wo);
        const F8 alpha(roughness * roughness);
        EXPECT_NEAR(Lanes(ggx::white_albedo(w, alpha, F8(strength)))[0], white, 1e-2) << degrees << " " << azimuth;
        EXPECT_NEAR(Lanes(ggx::coat_albedo(w, alpha, F8(strength)))[0], coat, 2e-3) << degrees << " " << azimuth;
      }
    }
  }
}

bool same_bits(F8 a, F8 b, M8 lanes) {
  return (and_not(lanes, float_bits(a) == float_bits(b))).none();
}

/// Isotropic surfaces have the same bits beside anisotropic ones in other lanes.
TEST(Anisotropy, DoesNotChangeOtherLanes) {
  const M8 plain = first_lanes(3);
  for (const Parameters& p : principled_surfaces()) {
    const V8 wo = to_lanes(direction(50, 20)), wi = to_lanes(direction(40, 170));
    const Pair8 u{F8(0.37f), F8(0.61f)};
    Parameters isotropic = p;
    isotropic.anisotropy = 0;
    PrincipledParameters8 mixed = p.in_lanes();
    mixed.anisotropy->strength = masked(~plain, mixed.anisotropy->strength);
    const Principled8 a = isotropic.seen_from(wo), b(mixed, F8(p.ior), wo, M8(true));
    EXPECT_TRUE(same_bits(a.eval(wo, wi).y, b.eval(wo, wi).y, plain));
    EXPECT_FALSE(same_bits(a.eval(wo, wi).y, b.eval(wo, wi).y, ~plain));
    EXPECT_TRUE(same_bits(a.pdf_solid_angle(wo, wi), b.pdf_solid_angle(wo, wi), plain));
    for (const float choice : {0.05f, 0.5f, 0.95f}) {
      const BsdfSample8 s = a.sample(wo, u, F8(choice)), t = b.sample(wo, u, F8(choice));
      EXPECT_TRUE(same_bits(s.wi.x, t.wi.x, plain));
      EXPECT_TRUE(same_bits(s.weight.x, t.weight.x, plain));
      EXPECT_TRUE(same_bits(s.pdf_solid_angle, t.pdf_solid_angle, plain));
    }
  }
}

TEST(Anisotropy, WithoutADirectionTheLobeHasTheSamePeak) {
  const V8 up = to_lanes({0, 0, 1});
  for (const auto& [roughness, strength] : kSurfaces) {
    const ggx::Facets8 brushed(F8(roughness * roughness), F8(strength), M8(true)),
        undirected(F8(roughness * roughness), F8(strength), M8());
    const auto peak = [&](const ggx::Facets8& facets) {
      return Lanes(facets.with_axes([&](const ggx::Alpha8& alpha) { return ggx::distribution(up, alpha); }))[0];
    };
    EXPECT_NEAR(peak(undirected), peak(brushed), 1e-4 * peak(brushed));
    EXPECT_TRUE(undirected.isotropic());
    EXPECT_NEAR(Lanes(brushed.mean_alpha())[0], Lanes(undirected.alpha())[0], 1e-6);
  }
}

/// A smooth surface with an anisotropy has a lobe.
TEST(Anisotropy, NoSurfaceIsSmoothAcrossIt) {
  const ggx::Facets8 scratched(F8(0.0f), F8(0.5f), M8(true));
  EXPECT_TRUE(scratched.rough().any());
  EXPECT_NEAR(Lanes(scratched.with_axes([](const ggx::Alpha8& alpha) { return alpha.x; }))[0], 0.25, 1e-4);
  EXPECT_FLOAT_EQ(static_cast<float>(Lanes(scratched.alpha())[0]), ggx::kSmoothAlpha);
}

}  // namespace
}  // namespace lightmill::test
