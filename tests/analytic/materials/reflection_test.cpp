// Phong's model and rough metal, with 100,000 draws each. The threshold raises a false alarm once in 3.5 million tests.
#include <complex>

#include "common/materials/conductor.h"
#include "common/materials/diffuse.h"
#include "common/materials/metals.h"
#include "common/materials/phong.h"
#include "tests/analytic/materials/bsdf_checks.h"
#include "tests/analytic/materials/microsurface_walk.h"
#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {
namespace {

const double kAngles[] = {0.01, 20, 50, 75, 88};

Phong8 phong(double diffuse, double specular, double exponent) {
  return {broadcast(Vec3(diffuse)), broadcast(Vec3(specular)), F8(static_cast<float>(exponent))};
}

TEST(Phong, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 100;
  for (const double exponent : {0.5, 1.0, 42.0, 1e3, 1e6}) {
    for (const double degrees : kAngles) {
      const Vec3d wo = tilted(degrees);
      const Grid grid(mirrored(wo), -wo, 1 / std::sqrt(1 + exponent));
      for (const auto& [d, s] : {std::pair(0.0, 1.0), {0.3, 0.5}}) {
        EXPECT_LT(sample_z(phong(d, s, exponent), wo, grid, ++seed, 1e-4), kChiSquaredThreshold)
            << exponent << " " << degrees << " " << d;
      }
    }
  }
}

TEST(Phong, ConservesEnergyAndReflectsAllOfItsAlbedoAtNormalIncidence) {
  std::uint32_t seed = 200;
  for (const double exponent : {0.0, 1.0, 42.0, 1e3, 1e6}) {
    for (const double degrees : kAngles) {
      const Vec3d wo = tilted(degrees);
      const Grid grid(mirrored(wo), -wo, 1 / std::sqrt(1 + exponent));
      const Albedo a = directional_albedo(phong(0.4, 0.6, exponent), wo, grid, ++seed);
      EXPECT_NEAR(a.by_sampling, a.by_quadrature, 5 * a.standard_error + 2e-3) << exponent << " " << degrees;
      EXPECT_LE(a.by_quadrature, 1.0005) << exponent << " " << degrees;
    }
    const Vec3d wo = tilted(0);
    const Grid grid(mirrored(wo), -wo, 1 / std::sqrt(1 + exponent));
    EXPECT_NEAR(directional_albedo(phong(0.4, 0.6, exponent), wo, grid, ++seed).by_quadrature, 1, 1e-3) << exponent;
  }
}

TEST(Phong, IsReciprocal) {
  for (const double exponent : {0.0, 5.0, 200.0}) {
    expect_reciprocity([&](const V8&, M8) { return phong(0.2, 0.7, exponent); }, 1, false, 1e-3);
  }
}

TEST(Phong, WithoutSpecularAlbedoItIsLambert) {
  const Phong8 bsdf = phong(0.7, 0, 30);
  const Diffuse8 lambert{broadcast(Vec3(0.7f))};
  const V8 wo = to_lanes(tilted(30));
  for (const double degrees : kAngles) {
    const V8 wi = to_lanes(mirrored(tilted(degrees)));
    EXPECT_EQ(Lanes(bsdf.eval(wo, wi).x)[0], Lanes(lambert.eval(wo, wi).x)[0]);
    EXPECT_EQ(Lanes(bsdf.pdf_solid_angle(wo, wi))[0], Lanes(lambert.pdf_solid_angle(wo, wi))[0]);
  }
}

TEST(Phong, ABlackOneReflectsNothing) {
  const BsdfSample8 s = phong(0, 0, 10).sample(to_lanes(tilted(30)), {F8(0.3f), F8(0.7f)}, F8(0.5f));
  EXPECT_EQ(Lanes(s.weight.x)[0], 0);
}

double conductor_fresnel(double cos_i, double n, double k) {
  return Lanes(
      conductor::fresnel(F8(static_cast<float>(cos_i)), F8(static_cast<float>(n)), F8(static_cast<float>(k))))[0];
}

TEST(Conductor, FresnelAgreesWithComplexAmplitudes) {
  for (const auto& [n, k] : {std::pair(0.2, 3.9), {1.4, 7.5}, {2.9, 3.1}, {0.05, 2.6}, {1.5, 0.0}, {4.0, 0.1}}) {
    for (int i = 1; i <= 100; ++i) {
      const double c = i / 100.0;
      EXPECT_NEAR(conductor_fresnel(c, n, k), fresnel_formula(c, {n, k}), 2e-6) << n << " " << k << " " << c;
    }
  }
}

TEST(Conductor, MetalsHaveTheIndicesOfTheirSources) {
  constexpr double kEnergies[] = {1239.84198 / 650, 1239.84198 / 550, 1239.84198 / 450};  // eV
  const auto check = [](const char* name, int channel, std::complex<double> index) {
    const auto metal = find_metal(name);
    ASSERT_TRUE(metal.has_value()) << name;
    EXPECT_NEAR(metal->eta[channel], index.real(), 2e-4) << name << channel;
    EXPECT_NEAR(metal->k[channel], index.imag(), 2e-4) << name << channel;
  };
  // Johnson and Christy 1972, table I: (eV, n, k) on either side of the three energies.
  struct Row {
    double energy, n, k;
  };
  const struct {
    const char* name;
    Row rows[6];
  } measured[] = {{"copper",
                   {{1.88, .22, 3.747},
                    {2.01, .30, 3.205},
                    {2.14, .70, 2.704},
                    {2.26, 1.02, 2.577},
                    {2.75, 1.24, 2.397},
                    {2.88, 1.25, 2.305}}},
                  {"silver",
                   {{1.88, .05, 4.483},
                    {2.01, .06, 4.152},
                    {2.14, .05, 3.858},
                    {2.26, .06, 3.586},
                    {2.75, .04, 2.657},
                    {2.88, .04, 2.462}}},
                  {"gold",
                   {{1.88, .14, 3.697},
                    {2.01, .21, 3.272},
                    {2.14, .29, 2.863},
                    {2.26, .43, 2.455},
                    {2.75, 1.38, 1.914},
                    {2.88, 1.45, 1.948}}}};
  for (const auto& metal : measured) {
    for (int channel = 0; channel < 3; ++channel) {
      const Row a = metal.rows[2 * channel], b = metal.rows[2 * channel + 1];
      const double t = (kEnergies[channel] - a.energy) / (b.energy - a.energy);
      check(metal.name, channel, {a.n + t * (b.n - a.n), a.k + t * (b.k - a.k)});
    }
  }
  // Rakić et al. 1998, table 2: plasma frequency, then (strength, damping, frequency) of each oscillator, in eV.
  struct Oscillator {
    double strength, damping, frequency;
  };
  const struct {
    const char* name;
    double plasma;
    std::vector<Oscillator> terms;
  } modelled[] = {
      {"aluminium",
       14.98,
       {{.523, .047, 0}, {.227, .333, .162}, {.050, .312, 1.544}, {.166, 1.351, 1.808}, {.030, 3.382, 3.473}}},
      {"chromium",
       10.75,
       {{.168, .047, 0}, {.151, 3.175, .121}, {.150, 1.305, .543}, {1.149, 2.676, 1.970}, {.825, 1.335, 8.775}}},
      {"nickel",
       15.92,
       {{.096, .048, 0}, {.100, 4.511, .174}, {.135, 1.334, .582}, {.106, 2.178, 1.597}, {.729, 6.292, 6.089}}},
      {"platinum",
       9.59,
       {{.333, .080, 0}, {.191, .517, .780}, {.659, 1.838, 1.314}, {.547, 3.668, 3.141}, {3.576, 8.517, 9.249}}}};
  for (const auto& metal : modelled) {
    for (int channel = 0; channel < 3; ++channel) {
      const double w = kEnergies[channel];
      std::complex<double> permittivity = 1;
      for (const Oscillator& o : metal.terms) {
        permittivity += o.strength * metal.plasma * metal.plasma /
                        std::complex<double>(o.frequency * o.frequency - w * w, -w * o.damping);
      }
      check(metal.name, channel, std::sqrt(permittivity));
    }
  }
  EXPECT_FALSE(find_metal("unobtainium").has_value());
}

Conductor8 metal(double alpha) {
  return {broadcast(Vec3(0.15f, 0.42f, 1.38f)), broadcast(Vec3(3.6f, 2.47f, 1.9f)), F8(static_cast<float>(alpha))};
}
/// Reflects everything.
Conductor8 white_metal(double alpha) {
  return {broadcast(Vec3(1)), broadcast(Vec3(1e4f)), F8(static_cast<float>(alpha))};
}

/// With the light of several bounces.
Conductor8 compensated(Conductor8 bsdf) {
  const auto first = [](const V8& v) { return Vec3(Lanes(v.x)[0], Lanes(v.y)[0], Lanes(v.z)[0]); };
  bsdf.mean_fresnel = broadcast(conductor::mean_fresnel(first(bsdf.eta), first(bsdf.k)));
  return bsdf;
}

TEST(Conductor, DrawsWhatItsPdfSays) {
  std::uint32_t seed = 300;
  for (const double alpha : {2e-4, 0.01, 0.1, 0.5, 1.0}) {
    for (const double degrees : kAngles) {
      const Vec3d wo = tilted(degrees);
      const Grid grid(mirrored(wo), -wo, std::min(2 * alpha, 0.3));
      EXPECT_LT(sample_z(compensated(metal(alpha)), wo, grid, ++seed, 1e-2), kChiSquaredThreshold)
          << alpha << " " << degrees;
      EXPECT_LT(sample_z(metal(alpha), wo, grid, seed, 1e-2), kChiSquaredThreshold) << alpha << " " << degrees;
    }
  }
}

TEST(Conductor, ConservesEnergy) {
  std::uint32_t seed = 400;
  for (const double alpha : {2e-4, 0.01, 0.1, 0.5, 1.0}) {
    for (const double degrees : kAngles) {
      const Vec3d wo = tilted(degrees);
      const Albedo a = directional_albedo(white_metal(alpha), wo, Grid(mirrored(wo), -wo, 2 * alpha), ++seed);
      EXPECT_NEAR(a.by_sampling, a.by_quadrature, 5 * a.standard_error + 3e-3) << alpha << " " << degrees;
      EXPECT_LE(a.by_sampling, 1.0001) << alpha << " " << degrees;
    }
  }
}

TEST(Conductor, WhiteMetalLosesNothingWhenSmoothAndLnTwoAtAlphaOne) {
  const Vec3d up = tilted(0);
  EXPECT_NEAR(directional_albedo(white_metal(1e-3), up, Grid(up, -up, 2e-3), 1).by_sampling, 1, 1e-4);
  // At normal incidence G2/G1 of visible normals is the mean of G1-like shadowing. For alpha = 1 the normal is uniform in
  // projected area (tan θm uniform), wi = 2θm, and G2/G1 = 1/(1 + Λ(wi)) = 2 cos θi/(cos θi + 1). With x = cos² θm
  // uniform in [0, 1], cos θi = 2x − 1 > 0. The integral of 2(2x − 1)/(2x) over x in [1/2, 1] is 1 − ln 2.
  EXPECT_NEAR(directional_albedo(white_metal(1), up, Grid(up, -up, 2), 2).by_quadrature, 1 - std::log(2.0), 1e-3);
}

TEST(Conductor, SingleScatteringHasTheAlbedoOfThePublishedFormula) {
  for (const double alpha : {0.15, 0.3, 0.7, 1.0}) {
    for (const double degrees : {0.01, 40.0, 70.0, 82.0}) {
      const Vec3d wo = tilted(degrees);
      const Albedo a = directional_albedo(metal(alpha), wo, Grid(mirrored(wo), -wo, 2 * alpha), 5);
      const double exact = integral_over_hemisphere([&](const Vec3d& wi) {
        return conductor_formula(0.42, 2.47, alpha, {wo.x, wo.z, 0}, wi);
      });
      EXPECT_NEAR(a.by_sampling, exact, 5 * a.standard_error + 1e-3) << alpha << " " << degrees;
    }
  }
}

TEST(Conductor, CompensatedWhiteMetalReflectsAll) {
  for (const double roughness : {0.01, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0}) {
    for (const double degrees : {0.01, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0}) {
      const Vec3d wo = tilted(degrees);
      EXPECT_NEAR(even_albedo(compensated(white_metal(roughness * roughness)), wo), 1, 0.01)
          << roughness << " " << degrees;
    }
  }
}

/// Chandrasekhar 1950, "Radiative Transfer": the H function of isotropic scatterers that absorb nothing.
double h_function(double mu) {
  constexpr int kSteps = 100'000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double phi = (i + 0.5) / kSteps * M_PI / 2, c = std::cos(phi), s = std::sin(phi);
    sum += std::log(1 - phi * c / s) / (c * c + mu * mu * s * s);
  }
  return std::exp(-mu / M_PI * sum * M_PI / 2 / kSteps);
}

// Facets of alpha = 1 that scatter once have the BRDF 1/(2π (μo + μi)). Only one pair of factors for both directions makes
// it reflect all light. It gives H(μo) H(μi)/(4π (μo + μi)), the BRDF of isotropic scatterers that absorb nothing.
TEST(Conductor, AtAlphaOneBalancedFacetsFollowChandrasekharsLaw) {
  ASSERT_NEAR(h_function(1), 2.9078, 1e-3);  // Chandrasekhar's table XI
  for (const double o : {0.05, 0.3, 0.7, 1.0}) {
    for (const double i : {0.1, 0.5, 0.9}) {
      const V8 wo = to_lanes({std::sqrt(1 - o * o), 0, o}), wi = to_lanes({0, std::sqrt(1 - i * i), i});
      const double exact = h_function(o) * h_function(i) / (4 * M_PI * (o + i)) * i;
      EXPECT_NEAR(Lanes(compensated(white_metal(1)).eval(wo, wi).x)[0], exact, 0.01 * exact) << o << " " << i;
    }
  }
}

TEST(Conductor, CompensationTintsAsWalksOverASurfaceOfFacetsDo) {
  for (const auto& [n, k] : {std::pair(0.42f, 2.47f), {1.38f, 1.9f}, {2.9f, 3.1f}}) {
    const auto fresnel = [&](double cosine) { return fresnel_formula(cosine, {n, k}); };
    for (const double alpha : {0.2, 0.5, 1.0}) {
      for (const double degrees : {0.01, 50.0, 80.0}) {
        const Vec3d wo = tilted(degrees);
        const WalkedAlbedo walked = walked_albedo(wo, alpha, fresnel, 30'000, 7);
        const Conductor8 bsdf{broadcast(Vec3(n)), broadcast(Vec3(k)), F8(static_cast<float>(alpha))};
        EXPECT_NEAR(even_albedo(bsdf, wo), walked.once, 0.015) << n << " " << alpha << " " << degrees;
        EXPECT_NEAR(even_albedo(compensated(bsdf), wo), walked.all, 0.03) << n << " " << alpha << " " << degrees;
      }
    }
  }
}

TEST(Conductor, IsReciprocal) {
  for (const double alpha : {0.05, 0.3, 1.0}) {
    expect_reciprocity([&](const V8&, M8) { return metal(alpha); }, 1, false, 2e-3);
    expect_reciprocity([&](const V8&, M8) { return compensated(metal(alpha)); }, 1, false, 2e-3);
  }
}

TEST(Conductor, IsAMirrorWithFresnelsColourWhenSmooth) {
  const Vec3d wo = tilted(40);
  const Conductor8 bsdf = metal(0);
  const BsdfSample8 s = bsdf.sample(to_lanes(wo), {F8(0.3f), F8(0.6f)}, F8(0.5f));
  EXPECT_EQ(Lanes(s.pdf_solid_angle)[0], 0);
  EXPECT_NEAR(Lanes(s.wi.x)[0], -wo.x, 1e-6);
  EXPECT_NEAR(Lanes(s.weight.z)[0], conductor_fresnel(wo.z, 1.38, 1.9), 1e-6);
  EXPECT_EQ(Lanes(bsdf.eval(to_lanes(wo), to_lanes(mirrored(wo))).x)[0], 0);
}

}  // namespace
}  // namespace lightmill::test
