// Materials through public scene documents: radiances that are known in closed form, or by a sum over a lamp of each
// model's published formula, in double precision and from other pieces than the renderer's.
#include <cmath>
#include <complex>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string named(const std::string& name, const std::string& kind, double emission = 0) {
  return fmt::format(R"({{"name": "{}", {}, "emission": {}}})", name, kind, gray(emission));
}
std::string phong(double d, double s, double exponent) {
  return fmt::format(R"("phong": {{"diffuse": {}, "specular": {}, "exponent": {}}})", gray(d), gray(s), exponent);
}
std::string conductor(double n, double k, double roughness) {
  return fmt::format(R"("conductor": {{"eta": {}, "k": {}, "roughness": {}}})", gray(n), gray(k), roughness);
}
std::string glass(double ior, double roughness) {
  return fmt::format(R"("dielectric": {{"ior": {}, "roughness": {}}})", ior, roughness);
}
std::string view(const Vec3d& eye, const Vec3d& at, const Vec3d& up = Vec3d(1, 0, 0)) {
  return fmt::format(R"("eye": [{}, {}, {}], "look_at": [{}, {}, {}], "up": [{}, {}, {}])", eye.x, eye.y, eye.z, at.x,
                     at.y, at.z, up.x, up.y, up.z);
}

// ---- the models, for directions away from a surface whose normal is +y; BSDF times the cosine of wi ----

double phong_formula(double d, double s, double exponent, const Vec3d& wo, const Vec3d& wi) {
  const double cosine = std::max(0.0, glm::dot(Vec3d(-wo.x, wo.y, -wo.z), wi));
  return (d / M_PI + s * (exponent + 2) / (2 * M_PI) * std::pow(cosine, exponent)) * wi.y;
}
double ggx_d(double cos_m, double alpha) {
  const double tan2 = 1 / (cos_m * cos_m) - 1;
  return alpha * alpha / (M_PI * std::pow(cos_m, 4) * std::pow(alpha * alpha + tan2, 2));
}
double ggx_lambda(double cosine, double alpha) {
  return (std::sqrt(1 + alpha * alpha * (1 / (cosine * cosine) - 1)) - 1) / 2;
}
double fresnel_formula(double cosine, std::complex<double> index) {
  const std::complex<double> ct = std::sqrt(1.0 - (1 - cosine * cosine) / (index * index));
  return (std::norm((cosine - index * ct) / (cosine + index * ct)) +
          std::norm((index * cosine - ct) / (index * cosine + ct))) /
         2;
}
double conductor_formula(double n, double k, double alpha, const Vec3d& wo, const Vec3d& wi) {
  const Vec3d m = glm::normalize(wo + wi);
  const double g = 1 / (1 + ggx_lambda(wo.y, alpha) + ggx_lambda(wi.y, alpha));
  return ggx_d(m.y, alpha) * g * fresnel_formula(glm::dot(wo, m), {n, k}) / (4 * wo.y);
}
/// Walter et al. 2007, eq. 21, of light that comes from the denser side below.
double refraction_formula(double n, double alpha, const Vec3d& wo, const Vec3d& wi) {
  Vec3d m = -glm::normalize(wo + wi * n);
  m = m.y < 0 ? -m : m;
  const double g = 1 / (1 + ggx_lambda(wo.y, alpha)) / (1 + ggx_lambda(wi.y, alpha));
  const double om = glm::dot(wo, m), im = glm::dot(wi, m);
  const double transmittance = 1 - fresnel_formula(om, n);
  return std::abs(im * om) / wo.y * transmittance * g * ggx_d(m.y, alpha) / std::pow(om + n * im, 2);
}

TEST(GlossyFloor, ShowsAPointLightByItsFormula) {
  const Vec3d light(0.4, 1.5, -0.3), eye(-0.6, 1.2, 0.5);
  const double distance2 = glm::dot(light, light);
  const Vec3d wo = glm::normalize(eye), wi = glm::normalize(light);
  const struct {
    std::string kind;
    double f;
  } cases[] = {{phong(0.3, 0.6, 20), phong_formula(0.3, 0.6, 20, wo, wi)},
               {phong(0, 1, 200), phong_formula(0, 1, 200, wo, wi)},
               {conductor(0.2, 3.9, 0.5), conductor_formula(0.2, 3.9, 0.25, wo, wi)},
               {conductor(2.9, 3.1, 0.9), conductor_formula(2.9, 3.1, 0.81, wo, wi)},
               {R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "metallic": 1, "roughness": 0.6})",
                conductor_formula(1, 1e5, 0.36, wo, wi)},
               {R"("principled": {"base_color": {"rgb": [0.7, 0.7, 0.7]}, "specular": 0})", 0.7 / M_PI * wi.y}};
  for (const auto& c : cases) {
    const auto scene =
        TestScene::from_text(document(view(eye, Vec3d(0)), 0.01, 8, named("floor", c.kind), mesh("floor", "floor.obj"),
                                      fmt::format(R"({{"point": {{"position": [{}, {}, {}], "intensity": {}}}}})",
                                                  light.x, light.y, light.z, gray(2))),
                             {{"floor.obj", plane(20, 0, true)}});
    const double exact = 2 / distance2 * c.f;
    EXPECT_NEAR(mean_of(scene.render({"path", 20, 1}, 4), 0).value, exact, 5e-4 * exact) << c.kind;
  }
}

TEST(GlossyFloor, RoughGlassShowsAPointLightBelow) {
  const Vec3d light(0.3, -1.1, 0.2), eye(-0.7, 1.2, 0.1);
  const Vec3d wo = glm::normalize(eye), wi = glm::normalize(light);
  for (const auto& [ior, roughness] : {std::pair(1.5, 0.5), {1.33, 0.8}}) {
    const auto scene = TestScene::from_text(
        document(view(eye, Vec3d(0)), 0.01, 8, named("floor", glass(ior, roughness)), mesh("floor", "floor.obj"),
                 fmt::format(R"({{"point": {{"position": [{}, {}, {}], "intensity": {}}}}})", light.x, light.y, light.z,
                             gray(2))),
        {{"floor.obj", plane(20, 0, true)}});
    const double exact = 2 / glm::dot(light, light) * refraction_formula(ior, roughness * roughness, wo, wi);
    EXPECT_NEAR(mean_of(scene.render({"path", 21, 1}, 4), 0).value, exact, 5e-4 * exact) << ior;
  }
}

/// Radiance of a floor's point below a sphere lamp of radiance 1: the formula summed over the cone of the lamp.
template <class Formula>
double lit_by_sphere(const Vec3d& center, double radius, const Vec3d& wo, Formula f) {
  const double distance = glm::length(center), sin_max = radius / distance;
  const double one_minus_cos = 1 - std::sqrt(1 - sin_max * sin_max);
  const Vec3d n = center / distance, s = glm::normalize(glm::cross(n, Vec3d(0.1, 0.2, 0.9))), t = glm::cross(n, s);
  constexpr int kSteps = 600;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double h = (i + 0.5) / kSteps * one_minus_cos, phi = 2 * M_PI * (j + 0.5) / kSteps;
      const double r = std::sqrt(h * (2 - h));
      sum += f(wo, n * (1 - h) + (s * std::cos(phi) + t * std::sin(phi)) * r);
    }
  }
  return sum * 2 * M_PI * one_minus_cos / (kSteps * kSteps);
}

TEST(GlossyFloor, ShowsASphereLampByItsFormula) {
  // Large and near the mirror direction: both techniques find it, and their weights must add up.
  const Vec3d lamp(0.5, 1, 0.1), eye(-0.7, 1.2, 0);
  const Vec3d wo = glm::normalize(eye);
  const struct {
    std::string kind;
    std::function<double(const Vec3d&, const Vec3d&)> f;
  } cases[] = {{phong(0.2, 0.7, 50), [](const Vec3d& o, const Vec3d& i) { return phong_formula(0.2, 0.7, 50, o, i); }},
               {phong(0, 0.9, 1000), [](const Vec3d& o, const Vec3d& i) { return phong_formula(0, 0.9, 1000, o, i); }},
               {conductor(0.2, 3.9, 0.3),
                [](const Vec3d& o, const Vec3d& i) { return conductor_formula(0.2, 3.9, 0.09, o, i); }},
               {conductor(0.2, 3.9, 0.8),
                [](const Vec3d& o, const Vec3d& i) { return conductor_formula(0.2, 3.9, 0.64, o, i); }}};
  for (const auto& c : cases) {
    const auto scene = TestScene::from_text(
        document(view(eye, Vec3d(0)), 0.01, 8, named("floor", c.kind) + "," + diffuse("lamp", 0, 1),
                 mesh("floor", "floor.obj") + "," + sphere("lamp", "[0.5, 1, 0.1]", 0.4)),
        {{"floor.obj", plane(20, 0, true)}});
    expect_answer(mean_of(scene.render({"path", 22, 1}, 10), 0), lit_by_sphere(lamp, 0.4, wo, c.f), 3e-3);
  }
}

/// A floor seen straight from above under a sky of radiance 1, all of it black but for the sky.
double under_sky(const std::string& kind, std::uint64_t seed, double degrees = 0) {
  const double theta = degrees * M_PI / 180;
  const auto scene =
      TestScene::from_text(document(view({std::sin(theta), std::cos(theta), 0.0}, Vec3d(0), {0, 0, 1}), 0.01, 8,
                                    diffuse("sky", 0, 1) + "," + diffuse("black", 0) + "," + named("floor", kind),
                                    sphere("sky", "[0, 0, 0]", 20, true) + "," + mesh("floor", "floor.obj") + "," +
                                        mesh("black", "black.obj")),
                           {{"floor.obj", plane(60, 0, true)}, {"black.obj", plane(60, -0.5, true)}});
  const Estimate estimate = mean_of(scene.render({"path", seed, 0}, 11), 0);
  EXPECT_LT(estimate.standard_error, 1e-3);
  return estimate.value;
}

TEST(WhiteFurnace, WhatReflectsAllCannotBeToldFromTheSky) {
  EXPECT_NEAR(under_sky(phong(0.4, 0.6, 30), 30), 1, 4e-3);  // at normal incidence
  EXPECT_NEAR(under_sky(conductor(1, 1000, 0), 31, 40), 1, 1e-4);
  EXPECT_NEAR(under_sky(conductor(1, 1000, 0.1), 32, 40), 1, 1e-3);
  for (const double degrees : {0.0, 70.0}) {
    EXPECT_NEAR(under_sky(R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "roughness": 0.4})", 33, degrees), 1,
                6e-3);
  }
}

TEST(WhiteFurnace, VeryRoughWhiteMetalLosesLnTwoOfIt) {
  // As derived in the sampler's test: single scattering leaves 1 − ln 2 at α = 1.
  EXPECT_NEAR(under_sky(conductor(1, 1000, 1), 34), 1 - std::log(2.0), 4e-3);
}

TEST(WhiteFurnace, ASmoothMetalRoomSeenFromItsCentre) {
  // Each ray keeps to a diameter: 1/(1 − F), F = k²/(k² + 4) for n = 1.
  const auto scene =
      TestScene::from_text(document(view({0, 0, 0}, {0, 0, -1}), 0.01, 8, named("wall", conductor(1, 1, 0), 1),
                                    sphere("wall", "[0, 0, 0]", 1, true)));
  expect_answer(mean_of(scene.render({"path", 35, 0}, 10), 0), 1.25, 1e-3);
}

TEST(WhiteFurnace, RoomsOfEveryKindWithoutGlossAreDiffuse) {
  for (const std::string& kind :
       {phong(0.5, 0, 10), std::string(R"("principled": {"base_color": {"rgb": [0.5, 0.5, 0.5]}, "specular": 0})")}) {
    const auto scene =
        TestScene::from_text(document(kInside, 60, 32, named("wall", kind, 1), sphere("wall", "[0, 0, 0]", 1, true)));
    expect_answer(mean_of(scene.render({"path", 36, 0}, 8), 1), 2, 1e-3);
  }
}

TEST(WhiteFurnace, ClearRoughGlassHidesInUniformLight) {
  // Of slightly rough facets next to nothing is lost.
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 20, 32,
                                    diffuse("sky", 0, 1) + "," + named("glass", glass(1.5, 0.15)),
                                    sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("glass", "[0, 0, 0]", 1)));
  EXPECT_NEAR(mean_of(scene.render({"path", 37, 0}, 8), 0).value, 1, 3e-3);
}

TEST(Metals, GoldHasItsColourAtNormalIncidence) {
  // Johnson and Christy's n and k at 650, 550 and 450 nm.
  const double n[3] = {0.155, 0.423, 1.383}, k[3] = {3.607, 2.475, 1.915};
  const auto scene =
      TestScene::from_text(document(view({0, 1, 0}, {0, 0, 0}), 0.01, 8,
                                    diffuse("sky", 0, 1) + R"(, {"name": "gold", "conductor": {"metal": "gold"}})",
                                    sphere("sky", "[0, 0, 0]", 20, true) + "," + mesh("gold", "floor.obj")),
                           {{"floor.obj", plane(60, 0, true)}});
  for (int channel = 0; channel < 3; ++channel) {
    const double k2 = k[channel] * k[channel];
    const double exact = (std::pow(n[channel] - 1, 2) + k2) / (std::pow(n[channel] + 1, 2) + k2);
    EXPECT_NEAR(mean_of(scene.render({"path", 38, 0}, 4), channel).value, exact, 5e-4);
  }
}

TEST(Fresnel, SlightlyRoughGlassShowsTheSkyByItsReflectance) {
  for (const auto& [degrees, exact] : {std::pair(0.0, 0.04), {45.0, 0.0502399}, {60.0, 0.0891867}, {75.0, 0.2530606}}) {
    EXPECT_NEAR(under_sky(glass(1.5, 0.03), 39, degrees), exact, 0.01 * exact + 1e-3) << degrees;
  }
}

}  // namespace
}  // namespace lightmill::test
