// Media inside glass: Bouguer's law, nested and overlapping shapes, cameras inside. All are public scene documents.
#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string medium(const std::string& name, double ior, const std::string& interior, int priority = 0) {
  return fmt::format(R"({{"name": "{}", "dielectric": {{"ior": {}}}, "interior": {{{}}}, "priority": {}}})", name, ior,
                     interior, priority);
}
std::string absorbing(double sigma) {
  return R"("absorption": )" + gray(sigma);
}

/// A slab, given by its two faces.
struct Slab {
  std::string material;
  double top, bottom;
};

/// An emitter of radiance 1 below everything, seen straight down through slabs.
Estimate seen_through(const std::string& materials, const std::vector<Slab>& slabs, bool from_below = false,
                      const std::string& method = "path") {
  std::string objects = mesh("lamp", "lamp.obj");
  std::map<std::string, std::string> files;
  for (const Slab& slab : slabs) {
    const std::string name = fmt::format("{}{}", slab.material, files.size());
    objects += fmt::format(",{},{}", mesh(slab.material, name + "top.obj"), mesh(slab.material, name + "bottom.obj"));
    files[name + "top.obj"] = plane(60, slab.top, true);
    files[name + "bottom.obj"] = plane(60, slab.bottom, false);
  }
  const double sign = from_below ? -1 : 1;
  files["lamp.obj"] = plane(60, sign * -9, !from_below);
  const auto scene = TestScene::from_text(
      document(fmt::format(R"("eye": [0.1, {}, 0.2], "look_at": [0.1, 0, 0.2], "up": [1, 0, 0])", sign * 8), 0.01, 8,
               diffuse("lamp", 0, 1) + "," + materials, objects),
      files);
  return mean_of(scene.render({method, 40, 0}, method == "path" ? 12 : 1), 0);
}

TEST(Media, AnAbsorbingSlabTransmitsWhatItsInnerReflectionsSumTo) {
  const struct { double depth, exact; } cases[] = {{0.1, 0.8349920}, {1, 0.3391111}, {3, 0.0458839}};
  for (const auto& c : cases) {
    expect_answer(seen_through(medium("glass", 1.5, absorbing(c.depth / 2)), {{"glass", 1, -1}}), c.exact, 1e-2);
  }
  // Another index: R = ((n − 1)/(n + 1))² = 1/9, t = e^−.7.
  const double r = 1.0 / 9, t = std::exp(-0.7);
  expect_answer(seen_through(medium("glass", 2, absorbing(0.7)), {{"glass", 0.5, -0.5}}),
                (1 - r) * (1 - r) * t / (1 - r * r * t * t), 2e-3);
}

/// Directional albedo at normal incidence of a GGX coat with index 1.5, by quadrature over the half angle.
/// For light at θ the half vector is at θ/2, and the masking of the other direction is 1 (Heitz 2014).
double coat_albedo(double roughness) {
  const double a2 = std::pow(roughness, 4);
  if (a2 == 0) {
    return 0.04;
  }
  constexpr int kSteps = 200'000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double theta = (i + 0.5) / kSteps * M_PI / 2, h = std::cos(theta / 2);
    const double d = a2 / (M_PI * std::pow(h * h * (a2 - 1) + 1, 2));
    const double masking = 2 / (1 + std::sqrt(1 + a2 * std::pow(std::tan(theta), 2)));
    const double t = std::sqrt(1 - (1 - h * h) / 2.25), s = (h - 1.5 * t) / (h + 1.5 * t),
                 p = (1.5 * h - t) / (1.5 * h + t);
    sum += (s * s + p * p) / 2 * d * masking / 4 * 2 * M_PI * std::sin(theta);
  }
  return sum * M_PI / 2 / kSteps;
}

// A coat of albedo E transmits (1 − E) at each crossing, and sends E of the light from within back. Below it are
// Fresnel's R, the base colour at each refraction, and Bouguer's law. Coats take up to .0005 more or less, by the
// interpolation of their albedo (ggx_albedo.h).
TEST(Media, CoatedAbsorbingGlassTransmitsWhatItsLayersLeave) {
  const double r = 0.04, base = 0.8, t = std::exp(-0.7);
  for (const double coat : {0.0, 0.5, 1.0}) {
    for (const double roughness : {0.0, 0.6}) {
      const std::string glass = fmt::format(
          R"({{"name": "glass", "principled": {{"base_color": {}, "transmission": 1, "roughness": 0, "ior": 1.5,
              "coat": {}, "coat_roughness": {}}}, "interior": {{{}}}}})",
          gray(base), coat, roughness, absorbing(0.7));
      const auto transmitted = [&](double albedo) {
        const double inner = r + (1 - r) * base * base * coat * albedo;
        return std::pow((1 - coat * albedo) * (1 - r) * base, 2) * t / (1 - inner * inner * t * t);
      };
      const double albedo = coat_albedo(roughness), most = transmitted(albedo - 0.0005),
                   least = transmitted(albedo + 0.0005);
      const Estimate seen = seen_through(glass, {{"glass", 0.5, -0.5}});
      const double slack = 5 * seen.standard_error + kRounding * most;  // a false alarm once in 3.5 million
      EXPECT_LT(slack, 3e-3 * most) << "too much noise to compare";
      EXPECT_LE(seen.value, most + slack) << coat << " " << roughness;
      EXPECT_GE(seen.value, least - slack) << coat << " " << roughness;
    }
  }
}

TEST(Media, ColourCGivesAbsorptionOneMinusCOverC) {
  const struct { double color, exact; } cases[] = {{0.5, 0.3678794}, {0.9, 0.8948393}, {1, 1}, {0.2, std::exp(-4)}};
  for (const auto& c : cases) {
    const Estimate seen = seen_through(medium("m", 1, R"("color": )" + gray(c.color)), {{"m", 0.5, -0.5}});
    expect_answer(seen, c.exact, 1e-2);
    const std::vector<Slab> slab{{"m", 0.5, -0.5}};
    EXPECT_NEAR(seen_through(medium("m", 1, R"("color": )" + gray(c.color)), slab, false, "whitted").value, c.exact,
                2e-5);
  }
  for (const std::string method : {"path", "whitted"}) {
    EXPECT_EQ(seen_through(medium("m", 1, R"("color": )" + gray(0)), {{"m", 0.5, -0.5}}, false, method).value, 0);
  }
}

TEST(Media, TheScaleOfASceneDoesNotChangeTheTransmittance) {
  for (const double scale : {1e-3, 1e3}) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [0, {}, 0], "look_at": [0, 0, 0], "up": [1, 0, 0])", 3 * scale), 0.01, 8,
                 diffuse("lamp", 0, 1) + "," + medium("m", 1, absorbing(0.8 / scale)),
                 sphere("lamp", "[0, 0, 0]", 5 * scale, true) + "," + sphere("m", "[0, 0, 0]", scale)));
    expect_answer(mean_of(scene.render({"path", 41, 0}, 12), 0), std::exp(-1.6), 5e-3);
  }
}

TEST(Media, AnInnerShapeReplacesTheMediumAroundIt) {
  // Two units of the outer one, and one of the inner one.
  const std::string materials = medium("outer", 1, absorbing(0.3)) + "," + medium("inner", 1, absorbing(1.1));
  const std::vector<Slab> slabs{{"outer", 2, -1}, {"inner", 1, 0}};
  expect_answer(seen_through(materials, slabs), std::exp(-2 * 0.3 - 1.1), 5e-3);
  expect_answer(seen_through(materials, slabs, true), std::exp(-2 * 0.3 - 1.1), 5e-3);
}

TEST(Media, WhereShapesOverlapPriorityDecides) {
  // a fills [0, 2], and b [1, 3]. Both claim one unit.
  const std::vector<Slab> slabs{{"a", 2, 0}, {"b", 3, 1}};
  for (const int priority : {-1, 1}) {
    const std::string materials =
        medium("a", 1, absorbing(0.3), priority) + "," + medium("b", 1, absorbing(1.1), -priority);
    const double exact = priority > 0 ? std::exp(-2 * 0.3 - 1.1) : std::exp(-0.3 - 2 * 1.1);
    expect_answer(seen_through(materials, slabs), exact, 5e-3);
    expect_answer(seen_through(materials, slabs, true), exact, 5e-3);
  }
}

/// Transmittance of a row of interfaces between media of these indices. Each layer has its transmittance. Reflections
/// between them are summed as in a stack of plates (Stokes 1862).
double stack_transmittance(const std::vector<double>& indices, const std::vector<double>& layers) {
  double t = 1, r_back = 0;  // of all layers above, and their reflectance for light from below
  for (std::size_t i = 0; i + 1 < indices.size(); ++i) {
    const double layer = i == 0 ? 1 : layers[i - 1];
    const double a = indices[i], b = indices[i + 1], r = std::pow((a - b) / (a + b), 2);
    const double back = r_back * layer * layer;
    t = t * layer * (1 - r) / (1 - back * r);
    r_back = r + (1 - r) * (1 - r) * back / (1 - back * r);
  }
  return t;
}

TEST(Media, NestedGlassRefractsByTheRatioOfItsIndices) {
  const std::string materials = medium("water", 1.33, absorbing(0.2)) + "," + medium("flint", 1.8, absorbing(0.5));
  const double exact = stack_transmittance({1, 1.33, 1.8, 1.33, 1}, {std::exp(-0.2), std::exp(-0.5), std::exp(-0.2)});
  expect_answer(seen_through(materials, {{"water", 2, -1}, {"flint", 1, 0}}), exact, 5e-3);
  // A drop that reaches into the glass it lies on, the right way to model it. There is one face between them.
  const std::string overlapping = medium("water", 1.33, absorbing(0.2)) + "," + medium("flint", 1.8, absorbing(0.5), 1);
  expect_answer(seen_through(overlapping, {{"water", 2, 0.9}, {"flint", 1, 0}}),
                stack_transmittance({1, 1.33, 1.8, 1}, {std::exp(-0.2), std::exp(-0.5)}), 2e-3);
}

TEST(Media, SheetsOfOneGlassThatOverlapAreOneSheet) {
  const double r = 0.04;
  expect_answer(seen_through(medium("glass", 1.5, ""), {{"glass", 2, 0.5}, {"glass", 1, 0}}), (1 - r) / (1 + r), 1e-3);
}

TEST(Media, ClearGlassInGlassPassesTheWhiteFurnaceTest) {
  for (const int priority : {0, 3}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 4], "look_at": [0, 0, 0])", 30, 32,
                 diffuse("sky", 0, 1) + "," + medium("a", 1.5, "") + "," + medium("b", 1.2, "", priority) + "," +
                     medium("c", 2, ""),
                 sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("a", "[0, 0, 0]", 1) + "," +
                     sphere("b", "[0.3, 0.2, 0.4]", 0.6) + "," + sphere("c", "[0.1, -0.4, 0]", 0.3)));
    expect_answer(mean_of(scene.render({"path", 42, 0}, 8), 0), 1, 1e-3);
  }
}

/// The middle pixel of `count` nested clear glass balls under a sky of radiance 1: its mean, and how many of its 2^6
/// samples are not finite.
std::pair<double, std::uint32_t> middle_of_balls(int count, const std::string& method, double eye) {
  std::string balls = sphere("sky", "[0, 0, 0]", 10, true);
  for (int i = 0; i < count; ++i) {
    balls += also(sphere("glass", "[0, 0, 0]", 1 - 0.1 * i));
  }
  const auto scene = TestScene::from_text(document(fmt::format(R"("eye": [0, 0, {}], "look_at": [0, 0, -9])", eye), 1,
                                                   1, diffuse("sky", 0, 1) + also(medium("glass", 1.5, "")), balls));
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  EXPECT_TRUE(compiled.ok()) << message_of(compiled.status());
  const auto rendering = make_method(*compiled, {method, 1, 0});
  const auto workspace = (*rendering)->make_workspace();
  const Node node = (*rendering)->render({0, 0, 1, 1}, {6, 0}, *workspace);
  return {(node.values[0] + node.values[3]) / 64, node.non_finite};
}

TEST(Media, SamplesInMoreThanFourShapesAreCountedAsNotFinite) {
  for (const char* method : {"path", "whitted"}) {
    const auto [four, none] = middle_of_balls(4, method, 4);
    EXPECT_EQ(none, 0u) << method;
    EXPECT_NEAR(four, 1, method == std::string("path") ? 0.1 : 1e-3) << method;
    // Some of the 64 paths are reflected before they are in all five.
    EXPECT_GE(middle_of_balls(5, method, 4).second, 48u) << method;
    EXPECT_GE(middle_of_balls(8, method, 4).second, 48u) << method;
    EXPECT_EQ(middle_of_balls(5, method, 0).second, 64u) << method << ", with the camera in the middle";
  }
}

TEST(Media, ACameraInsideAbsorbingGlassSeesABrighterSky) {
  // Along a diameter. Radiance inside is n² denser, (1 − R) of it enters, and reflected light returns from the other
  // side.
  const double n = 1.5, r = 0.04, sigma = 0.6;
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 0, 0], "look_at": [0, 0, -1])", 0.01, 8,
                                    diffuse("sky", 0, 1) + "," + medium("glass", n, absorbing(sigma)),
                                    sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("glass", "[0, 0, 0]", 1)));
  const double exact = n * n * (1 - r) * std::exp(-sigma) / (1 - r * std::exp(-2 * sigma));
  expect_answer(mean_of(scene.render({"path", 43, 0}, 10), 0), exact, 5e-3);
}

TEST(Media, ACameraInsideNestedShapesStartsInAllOfThem) {
  const auto scene = TestScene::from_text(document(
      R"("eye": [0, 0, 0], "look_at": [0, 0, -1])", 0.01, 8,
      diffuse("sky", 0, 1) + "," + medium("inner", 1, absorbing(0.4)) + "," + medium("outer", 1, absorbing(0.9)),
      sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("inner", "[0, 0, 0]", 1) + "," +
          sphere("outer", "[0, 0, 0]", 2)));
  expect_answer(mean_of(scene.render({"path", 44, 0}, 12), 0), std::exp(-1.3), 5e-3);
}

TEST(Media, LightFromInsideAMediumIsAbsorbed) {
  // A white wall inside a block of the medium, lit by a point light at a distance of 1. The camera is also in the
  // block.
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 0.5, 0.3], "look_at": [0, 0, 0])", 0.01, 8,
                                    diffuse("wall", 1) + "," + medium("m", 1, absorbing(0.7)),
                                    mesh("wall", "wall.obj") + "," + sphere("m", "[0, 0, 0]", 30),
                                    R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, 1, 1]}}})"),
                           {{"wall.obj", plane(20, 0, true)}});
  const double to_eye = std::hypot(0.5, 0.3);
  expect_answer(mean_of(scene.render({"path", 45, 1}, 4), 0), std::exp(-0.7 * (1 + to_eye)) / M_PI, 2e-3);
}

TEST(Media, ShadowRaysPassSurfacesOfIndexOne) {
  // Clear and absorbing nested balls of index 1 between a light and a floor.
  const std::string light = R"({"point": {"position": [0, 4, 0], "intensity": {"rgb": [1, 1, 1]}}})";
  for (const double sigma : {0.0, 0.8}) {
    const auto scene = TestScene::from_text(
        document(
            R"("eye": [0, 0.5, 3], "look_at": [0, 0, 0])", 0.01, 8,
            diffuse("floor", 1) + "," + medium("a", 1, absorbing(sigma)) + "," + medium("b", 1, absorbing(0.3), 1),
            mesh("floor", "floor.obj") + "," + sphere("a", "[0, 2, 0]", 0.75) + "," + sphere("b", "[0, 2, 0]", 0.25),
            light),
        {{"floor.obj", plane(20, 0, true)}});
    EXPECT_NEAR(mean_of(scene.render({"path", 46, 1}, 4), 0).value, std::exp(-sigma - 0.3 * 0.5) / 16 / M_PI, 1e-6);
  }
  // Glass blocks them.
  const auto glass =
      TestScene::from_text(document(R"("eye": [0, 0.5, 3], "look_at": [0, 0, 0])", 0.01, 8,
                                    diffuse("floor", 1) + "," + medium("glass", 1.5, absorbing(0.1)),
                                    mesh("floor", "floor.obj") + "," + sphere("glass", "[0, 2, 0]", 0.75), light),
                           {{"floor.obj", plane(20, 0, true)}});
  EXPECT_EQ(mean_of(glass.render({"path", 46, 1}, 4), 0).value, 0);
}

TEST(Media, LightThroughIndexOneIsCountedOnce) {
  // A large sphere light seen from a floor through a sheet of index 1. Scattered rays and shadow rays find it.
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 0.2, 3], "look_at": [0, 0, 0])", 0.01, 8,
               diffuse("floor", 1) + "," + diffuse("lamp", 0, 1) + "," + medium("air", 1, ""),
               mesh("floor", "floor.obj") + "," + sphere("lamp", "[0, 2, 0]", 1.2) + "," + mesh("air", "sheet.obj")),
      {{"floor.obj", plane(20, 0, true)}, {"sheet.obj", plane(20, 0.4, true)}});
  expect_answer(mean_of(scene.render({"path", 47, 2}, 10), 0), 1.44 / 4, 2e-3);
}

TEST(Media, SurfacesThatDoNotRefractStillEmit) {
  // A ball of radius r and radiance 1 at distance d above a floor. Light passes its surface without refraction: E = π
  // r²/d². It is a bubble of index 1, or glass of lower priority than the medium that fills all space.
  const double r = 0.8, d = 2;
  const auto glowing = [](const std::string& name, double ior) {
    return fmt::format(R"({{"name": "{}", "dielectric": {{"ior": {}}}, "emission": {}}})", name, ior, gray(1));
  };
  const std::string ball = sphere("ball", fmt::format("[0, {}, 0]", d), r);
  const std::string floor = diffuse("floor", 1) + ",";
  const std::map<std::string, std::string> files{{"floor.obj", plane(20, 0, true)}};
  const struct {
    std::string materials, objects;
  } cases[] = {
      {glowing("ball", 1), ball},
      {glowing("ball", 1.5) + "," + medium("all", 1, absorbing(1e-9), 1), ball + "," + sphere("all", "[0, 0, 0]", 40)}};
  for (const auto& c : cases) {
    const auto lit = TestScene::from_text(document(R"("eye": [0, 0.5, 3], "look_at": [0, 0, 0])", 0.01, 8,
                                                   floor + c.materials, mesh("floor", "floor.obj") + "," + c.objects),
                                          files);
    expect_answer(mean_of(lit.render({"path", 48, 1}, 12), 0), r * r / (d * d), 3e-3);
    const auto seen =
        TestScene::from_text(document(fmt::format(R"("eye": [0.1, {0}, 3], "look_at": [0.1, {0}, 0])", d), 0.01, 8,
                                      floor + c.materials, mesh("floor", "floor.obj") + "," + c.objects),
                             files);
    for (const char* method : {"path", "raycast", "whitted"}) {
      EXPECT_NEAR(mean_of(seen.render({method, 49, 0}, 4), 0).value, 1, 1e-6) << method;
    }
  }
}

/// Henyey and Greenstein's function of the cosine between the directions before and after.
double phase(double g, double cosine) {
  return (1 - g * g) / (4 * M_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

TEST(Scattering, SingleScatteringAroundAPointLightMatchesTheIntegral) {
  // The light is at distance h from a line of sight in endless fog: ∫ σs e^(−σ(s + d)) p(cos θ) I/d² ds from the camera
  // on.
  const double h = 0.8, ahead = 1.5;
  for (const auto& [scattering, absorption, g] : {std::tuple(0.5, 0.0, 0.0), {0.4, 0.3, 0.6}, {1.5, 0.2, -0.5}}) {
    const double sigma = scattering + absorption;
    double exact = 0;
    constexpr int kSteps = 400'000;
    constexpr double kEnd = 40;
    for (int i = 0; i < kSteps; ++i) {
      const double s = kEnd * (i + 0.5) / kSteps, x = ahead - s, d2 = x * x + h * h, d = std::sqrt(d2);
      // Light travels from the light to the point, then back to the camera, against the line of sight.
      exact += kEnd / kSteps * scattering * std::exp(-sigma * (s + d)) * phase(g, x / d) / d2;
    }
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 0], "look_at": [0, 0, -1])", 0.01, 8,
                 medium("fog", 1,
                        fmt::format("{}, {}: {}, {}: {}", absorbing(absorption), R"("scattering")", gray(scattering),
                                    R"("anisotropy")", g)),
                 sphere("fog", "[0, 0, 0]", 60),
                 fmt::format(R"({{"point": {{"position": [0, {}, {}], "intensity": {}}}}})", h, -ahead, gray(1))));
    expect_answer(mean_of(scene.render({"path", 60, 1}, 13), 0), exact, 1e-2);
  }
}

TEST(Scattering, FogThatAbsorbsNothingPassesTheWhiteFurnaceTest) {
  for (const auto& [ior, g] : {std::pair(1.0, 0.0), {1.0, 0.8}, {1.5, 0.0}}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 16,
                 diffuse("sky", 0, 1) + "," +
                     medium("fog", ior, R"("scattering": {"rgb": [3, 1, 0]}, "anisotropy": )" + fmt::format("{}", g)),
                 sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("fog", "[0, 0, 0]", 1)));
    const HalfImages image = scene.render({"path", 61, 0}, 9);
    for (int channel = 0; channel < 3; ++channel) {
      expect_answer(mean_of(image, channel), 1, 1e-2);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
