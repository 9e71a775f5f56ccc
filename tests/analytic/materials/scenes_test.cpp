// Materials through public scene documents. Their radiances are known in closed form, or as a sum over an emitter of
// each model's published formula. The formulas use double precision and no code of the renderer.
#include <cmath>
#include <functional>

#include "tests/analytic/materials/published_formulas.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string phong(double d, double s, double exponent) {
  return fmt::format(R"("phong": {{"diffuse": {}, "specular": {}, "exponent": {}}})", gray(d), gray(s), exponent);
}
std::string conductor(double n, double k, double roughness) {
  return fmt::format(R"("conductor": {{"eta": {}, "k": {}, "roughness": {}}})", gray(n), gray(k), roughness);
}
std::string rough_diffuse(double albedo, double roughness) {
  return fmt::format(R"("diffuse": {{"reflectance": {}, "roughness": {}}})", gray(albedo), roughness);
}
std::string glass(double ior, double roughness) {
  return fmt::format(R"("dielectric": {{"ior": {}, "roughness": {}}})", ior, roughness);
}
/// Without the light of several bounces, as in the published formulas.
std::string once(const std::string& kind) {
  return kind + R"(, "single_scattering": true)";
}
std::string view(const Vec3d& eye, const Vec3d& at, const Vec3d& up = Vec3d(1, 0, 0)) {
  return fmt::format(R"("eye": [{}, {}, {}], "look_at": [{}, {}, {}], "up": [{}, {}, {}])", eye.x, eye.y, eye.z, at.x,
                     at.y, at.z, up.x, up.y, up.z);
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
               {rough_diffuse(0.7, 0.9), eon_formula(0.7, 0.9, wo, wi)},
               {once(rough_diffuse(0.7, 0.4)), fujii_formula(0.7, 0.4, wo, wi)},
               {once(conductor(0.2, 3.9, 0.5)), conductor_formula(0.2, 3.9, 0.25, wo, wi)},
               {once(conductor(2.9, 3.1, 0.9)), conductor_formula(2.9, 3.1, 0.81, wo, wi)},
               {once(R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "metallic": 1, "roughness": 0.6})"),
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
        document(view(eye, Vec3d(0)), 0.01, 8, named("floor", once(glass(ior, roughness))), mesh("floor", "floor.obj"),
                 fmt::format(R"({{"point": {{"position": [{}, {}, {}], "intensity": {}}}}})", light.x, light.y, light.z,
                             gray(2))),
        {{"floor.obj", plane(20, 0, true)}});
    const double exact = 2 / glm::dot(light, light) * refraction_formula(ior, roughness * roughness, wo, wi);
    EXPECT_NEAR(mean_of(scene.render({"path", 21, 1}, 4), 0).value, exact, 5e-4 * exact) << ior;
  }
}

TEST(GlossyFloor, ShowsASphereLightByItsFormula) {
  // The light is large and near the mirror direction. Both techniques find it, and their weights must add up.
  const Vec3d emitter(0.5, 1, 0.1), eye(-0.7, 1.2, 0);
  const Vec3d wo = glm::normalize(eye);
  const struct {
    std::string kind;
    std::function<double(const Vec3d&, const Vec3d&)> f;
  } cases[] = {{phong(0.2, 0.7, 50), [](const Vec3d& o, const Vec3d& i) { return phong_formula(0.2, 0.7, 50, o, i); }},
               {phong(0, 0.9, 1000), [](const Vec3d& o, const Vec3d& i) { return phong_formula(0, 0.9, 1000, o, i); }},
               {once(conductor(0.2, 3.9, 0.3)),
                [](const Vec3d& o, const Vec3d& i) { return conductor_formula(0.2, 3.9, 0.09, o, i); }},
               {once(conductor(0.2, 3.9, 0.8)),
                [](const Vec3d& o, const Vec3d& i) { return conductor_formula(0.2, 3.9, 0.64, o, i); }}};
  for (const auto& c : cases) {
    const auto scene = TestScene::from_text(
        document(view(eye, Vec3d(0)), 0.01, 8, named("floor", c.kind) + "," + diffuse("lamp", 0, 1),
                 mesh("floor", "floor.obj") + "," + sphere("lamp", "[0.5, 1, 0.1]", 0.4)),
        {{"floor.obj", plane(20, 0, true)}});
    expect_answer(mean_of(scene.render({"path", 22, 1}, 10), 0), lit_by_sphere(emitter, 0.4, wo, c.f), 3e-3);
  }
}

/// A black floor seen from straight above, under a sky of radiance 1.
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

TEST(WhiteFurnace, LosslessSurfacesAreInvisible) {
  EXPECT_NEAR(under_sky(phong(0.4, 0.6, 30), 30), 1, 4e-3);  // at normal incidence
  EXPECT_NEAR(under_sky(conductor(1, 1000, 0), 31, 40), 1, 1e-4);
  EXPECT_NEAR(under_sky(conductor(1, 1000, 0.1), 32, 40), 1, 1e-3);
  EXPECT_NEAR(under_sky(R"("mirror": {"reflectance": {"rgb": [1, 1, 1]}})", 30, 60), 1, 1e-6);
  EXPECT_NEAR(under_sky(R"("diffuse": {"reflectance": {"rgb": [1, 1, 1]}})", 30, 60), 1, 4e-3);
  EXPECT_NEAR(under_sky(R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "metallic": 1, "roughness": 0.1})", 31, 40),
              1, 1e-3);
  for (const double degrees : {0.0, 70.0}) {
    EXPECT_NEAR(under_sky(R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "roughness": 0.4})", 33, degrees), 1,
                6e-3);
  }
}

TEST(WhiteFurnace, VeryRoughWhiteMetalLosesLnTwoOnlyIfItScattersOnce) {
  // As derived in reflection_test.cpp: single scattering leaves 1 − ln 2 at alpha = 1.
  EXPECT_NEAR(under_sky(once(conductor(1, 1000, 1)), 34), 1 - std::log(2.0), 4e-3);
  EXPECT_NEAR(under_sky(conductor(1, 1000, 1), 34), 1, 8e-3);
}

TEST(WhiteFurnace, VeryRoughDiffuseSurfacesLoseLightOnlyIfTheyScatterOnce) {
  EXPECT_NEAR(under_sky(once(rough_diffuse(1, 1)), 34), fujii_albedo(1, 1), 4e-3);
  EXPECT_NEAR(under_sky(rough_diffuse(1, 1), 34), 1, 4e-3);
}

TEST(WhiteFurnace, RoughBallsAreInvisibleToEveryMethod) {
  const std::string white = R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "roughness": 0.5, )";
  for (const std::string& kind :
       {conductor(1, 1000, 0.9), glass(1.5, 0.5), rough_diffuse(1, 0.8), white + R"("metallic": 1})",
        white + R"("transmission": 1})", white + R"("metallic": 0.5, "coat": 1, "coat_roughness": 0.4})"}) {
    const auto scene = TestScene::from_text(document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 20, 16,
                                                     named("ball", kind), sphere("ball", "[0, 0, 0]", 1),
                                                     R"({"environment": {"radiance": {"rgb": [1, 1, 1]}}})"));
    for (const char* method : {"path", "caustic:photons=2000", "vcm:photons=2000"}) {
      const Estimate seen = mean_of(scene.render({method, 37, 0}, 8), 0);
      EXPECT_LT(seen.standard_error, 4e-3) << kind << method;
      EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 5e-3) << kind << method;
    }
  }
}

TEST(WhiteFurnace, ASmoothMetalRoomHasRadianceOneOverOneMinusF) {
  // Each ray stays on a diameter: 1/(1 − F), F = k²/(k² + 4) for n = 1.
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

TEST(WhiteFurnace, ClearRoughGlassIsInvisible) {
  // Slightly rough facets lose almost nothing.
  const auto principled = [](double ior, double roughness) {
    return fmt::format(R"("principled": {{"base_color": {}, "transmission": 1, "ior": {}, "roughness": {}}})", gray(1),
                       ior, roughness);
  };
  for (const std::string& kind :
       {glass(1.5, 0.15), glass(1.2, 0.1), principled(1.5, 0), principled(1.5, 0.15), principled(1.8, 0.1)}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 20, 32, diffuse("sky", 0, 1) + "," + named("glass", kind),
                 sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("glass", "[0, 0, 0]", 1)));
    const Estimate seen = mean_of(scene.render({"path", 37, 0}, 8), 0);
    EXPECT_LT(seen.standard_error, 1e-3) << kind;
    EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 2e-3) << kind;
  }
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
