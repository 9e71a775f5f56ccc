// `whitted` against closed forms of slabs, mirrors and light pipes, through public scene documents.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

using Files = std::map<std::string, std::string>;

/// Red value that a camera with a tiny field of view sees.
double seen(const std::string& view, const std::string& materials, const std::string& objects, const Files& files = {},
            const std::string& method = "whitted", const std::string& lights = "", std::uint32_t max_bounces = 0) {
  const auto scene = TestScene::from_text(document(view, 0.001, 8, materials, objects, lights), files);
  const Estimate value = mean_of(scene.render({method, 1, max_bounces}, 1), 0);
  EXPECT_LE(value.standard_error, 1e-4 * value.value) << "not one value";
  return value.value;
}

/// A wall of radiance 1, seen at this angle through a slab of index 1.5 and thickness 1. If the wall is on the camera's
/// side, its image in the slab.
double through_slab(double degrees, const std::string& method, const std::string& interior = "", bool behind = true,
                    const std::string& kind = R"("dielectric": {"ior": 1.5})") {
  const double theta = degrees * M_PI / 180;
  const std::string view = fmt::format(R"("eye": [{}, {}, 0], "look_at": [0.03, 0, 0.02], "up": [0, 0, 1])",
                                       3 * std::sin(theta) + 0.03, 3 * std::cos(theta));
  const std::string glass = fmt::format(R"({{"name": "glass", {}{}}})", kind, interior);
  const std::string wall =
      behind ? plane_shape("lamp", "[0, -5, 0]", "[0, 1, 0]") : plane_shape("lamp", "[0, 5, 0]", "[0, -1, 0]");
  return seen(view, glass + also(diffuse("lamp", 0, 1)), mesh("glass", "slab.obj") + also(wall),
              {{"slab.obj", box(-60, 47, -1, 0, -51, 56)}}, method);
}

TEST(Whitted, AClearSlabTransmitsTheWholeSeriesOfReflections) {
  // (1 − R)/(1 + R). The cut-off rest is less than 1e-5 of the light.
  EXPECT_NEAR(through_slab(0, "whitted"), 0.9230769, 1e-5);
  EXPECT_NEAR(through_slab(60, "whitted"), 0.8362325, 2e-5);
  // The slab reflects 2R/(1 + R).
  EXPECT_NEAR(through_slab(0, "whitted", "", false), 0.0769231, 1e-5);
  EXPECT_NEAR(through_slab(60, "whitted", "", false), 1 - 0.8362325, 2e-5);
}

TEST(Whitted, AnAbsorbingSlabFollowsBouguer) {
  for (const auto& [sigma, transmitted] : {std::pair{0.1, 0.8349920}, {1.0, 0.3391111}, {3.0, 0.0458839}}) {
    const std::string interior = fmt::format(R"(, "interior": {{"absorption": {}}})", gray(sigma));
    EXPECT_NEAR(through_slab(0, "whitted", interior), transmitted, 1e-5);
  }
}

TEST(Whitted, AFixedReflectanceReplacesFresnels) {
  // 0.9² (1 + 0.1² + 0.1⁴ + …) at any angle.
  EXPECT_NEAR(through_slab(0, "whitted:glass=0.1"), 0.81 / 0.99, 1e-5);
  EXPECT_NEAR(through_slab(60, "whitted:glass=0.1"), 0.81 / 0.99, 1e-5);
  EXPECT_NEAR(through_slab(30, "whitted:glass=0"), 1, 1e-5);
  EXPECT_NEAR(through_slab(0, "whitted:glass=1"), 0, 0);
  EXPECT_NEAR(through_slab(0, "whitted:glass=1", "", false), 1, 1e-5);
  // σ = 1: 0.9² e⁻¹ (1 + 0.1² e⁻² + …).
  EXPECT_NEAR(through_slab(0, "whitted:glass=0.1", R"(, "interior": {"absorption": {"rgb": [1, 1, 1]}})"),
              0.81 * std::exp(-1) / (1 - 0.01 * std::exp(-2)), 1e-5);
}

TEST(Whitted, GlassAndMirrorsShowAUniformSkyAsItIs) {
  const std::string sky = R"({"environment": {"radiance": {"rgb": [0.5, 0.5, 0.5]}}})";
  for (const std::string& material :
       {std::string(R"({"name": "ball", "dielectric": {"ior": 1.5}})"),
        std::string(R"({"name": "ball", "mirror": {}})"),
        fmt::format(R"({{"name": "ball", "principled": {{"base_color": {}, "metallic": 1,
                                                       "roughness": 0}}}})",
                    gray(1)),
        fmt::format(R"({{"name": "ball", "principled": {{"base_color": {}, "transmission": 1,
                                                       "roughness": 0}}}})",
                    gray(1))}) {
    for (const char* const method : {"whitted", "whitted:flat", "whitted:glass=0.4"}) {
      const auto scene = TestScene::from_text(
          document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 60, 32, material, sphere("ball", "[0, 0, 0]", 1), sky));
      for (const double value : scene.render({method, 1, 0}, 1).a) {
        ASSERT_NEAR(value, 0.5, 2e-4) << method;  // branches with less than 1e-5 end
      }
    }
  }
}

TEST(Whitted, SmoothPrincipledGlassIsGlassWithATint) {
  const auto kind = [](double base, double roughness) {
    return fmt::format(R"("principled": {{"base_color": {}, "transmission": 1, "roughness": {}}})", gray(base),
                       roughness);
  };
  EXPECT_NEAR(through_slab(0, "whitted", "", true, kind(1, 0)), 0.9230769, 1e-5);
  EXPECT_NEAR(through_slab(60, "whitted", "", false, kind(1, 0)), 1 - 0.8362325, 2e-5);
  EXPECT_NEAR(through_slab(0, "whitted", R"(, "interior": {"absorption": {"rgb": [1, 1, 1]}})", true, kind(1, 0)),
              0.3391111, 1e-5);
  // Refractions tint, reflections do not.
  EXPECT_NEAR(through_slab(0, "whitted", "", true, kind(0.5, 0)), 0.9230769 / 4, 1e-5);
  EXPECT_NEAR(through_slab(60, "whitted:glass=0.1", "", true, kind(0.5, 0)), 0.81 / 0.99 / 4, 1e-5);
  EXPECT_EQ(through_slab(0, "whitted", "", true, kind(1, 0.1)), 0);
}

TEST(Whitted, SmoothLayersReflectByTheirFresnelTerms) {
  // A wall of radiance 1, seen in an opaque plane. Metal has f0 + (1 − f0)(1 − cos θ)⁵, gloss and coat Fresnel's
  // equations for the index 1.5.
  const auto image = [](double degrees, const std::string& principled) {
    return through_slab(degrees, "whitted", "", false, fmt::format(R"("principled": {{{}}})", principled));
  };
  const std::string black = R"("base_color": {"rgb": [0, 0, 0]}, )", half = R"("base_color": {"rgb": [0.5, 1, 1]}, )";
  const std::string metal = half + R"("metallic": 1, "roughness": 0)";
  EXPECT_NEAR(image(0, metal), 0.5, 1e-5);
  EXPECT_NEAR(image(60, metal), 0.5 + 0.5 / 32, 1e-5);
  const std::string gloss = black + R"("roughness": 0)";
  EXPECT_NEAR(image(0, gloss), 0.04, 1e-6);
  EXPECT_NEAR(image(60, gloss), 0.0891867, 1e-5);
  const std::string coat = black + R"("specular": 0, "coat": 0.5, "coat_roughness": 0)";
  EXPECT_NEAR(image(0, coat), 0.5 * 0.04, 1e-6);
  EXPECT_NEAR(image(60, coat), 0.5 * 0.0891867, 1e-5);
  // Rough layers show no images. alpha = 1e-4 is rough, a smaller one is not.
  EXPECT_EQ(image(60, half + R"("metallic": 1, "roughness": 0.0101)"), 0);
  EXPECT_NEAR(image(60, half + R"("metallic": 1, "roughness": 0.0099)"), 0.5 + 0.5 / 32, 1e-5);
  EXPECT_EQ(image(60, black + R"("roughness": 0.3, "coat": 1)"), 0);
}

TEST(Whitted, PrincipledMaterialsShowAUniformSkyAsInThePathTracer) {
  // Smooth layers are followed, and the others are lit by the sky's mean. Nothing is lost or counted twice. `path` is
  // within 5 of its standard errors (a false alarm once in 1.7 million cases). Two approximations remain: the tables of
  // rough layers, and gloss below a coat that counts as diffuse.
  const std::string sky = R"({"environment": {"radiance": {"rgb": [0.5, 0.5, 0.5]}}})";
  struct Case {
    const char* layers;
    double tolerance;  ///< relative
  };
  for (const auto& [layers, tolerance] :
       {Case{R"("roughness": 0)", 1e-3}, Case{R"("metallic": 0.5, "roughness": 0)", 1e-3},
        Case{R"("specular": 0, "coat": 1, "coat_roughness": 0)", 1e-3},
        Case{R"("metallic": 1, "roughness": 0, "coat": 1, "coat_roughness": 0)", 1e-3},
        Case{R"("roughness": 0.4)", 0.01}, Case{R"("roughness": 0.4, "transmittance": {"rgb": [1, 1, 1]})", 0.01},
        Case{R"("metallic": 1, "roughness": 0.7)", 0.01},
        Case{R"("metallic": 1, "roughness": 0, "coat": 1, "coat_roughness": 0.4)", 0.01},
        Case{R"("roughness": 0, "coat": 1, "coat_roughness": 0)", 0.02},
        Case{R"("roughness": 0.5, "coat": 1, "coat_roughness": 0)", 0.02}}) {
    const std::string ball =
        fmt::format(R"({{"name": "ball", "principled": {{"base_color": {}, {}}}}})", gray(0.7), layers);
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 32, ball, sphere("ball", "[0, 0, 0]", 1), sky));
    const Estimate by_path = mean_of(scene.render({"path", 1, 0}, 8), 0);
    const Estimate by_whitted = mean_of(scene.render({"whitted", 1, 0}, 2), 0);
    EXPECT_LT(by_path.standard_error, 1e-3 * by_path.value) << layers;
    EXPECT_NEAR(by_whitted.value, by_path.value, 5 * by_path.standard_error + tolerance * by_path.value) << layers;
  }
}

TEST(Whitted, MirrorReflectancesMultiply) {
  // Between two mirrors of reflectance 0.5 at 45°. There are five reflections on the way to the emitter.
  const std::string mirror = fmt::format(R"({{"name": "mirror", "mirror": {{"reflectance": {}}}}})", gray(0.5));
  const std::string corridor = plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]") +
                               also(plane_shape("mirror", "[0, 1, 0]", "[0, -1, 0]")) +
                               also(plane_shape("lamp", "[5, 0, 0]", "[-1, 0, 0]"));
  const char* const view = R"("eye": [0, 0.5, 0], "look_at": [1, 1.5, 0], "up": [0, 0, 1])";
  const auto after = [&](std::uint32_t max_bounces) {
    return seen(view, mirror + also(diffuse("lamp", 0, 64)), corridor, {}, "whitted", "", max_bounces);
  };
  EXPECT_NEAR(after(0), 2, 1e-5);
  EXPECT_NEAR(after(5), 2, 1e-5);
  EXPECT_EQ(after(4), 0);
}

TEST(Whitted, GlassAmongMirrorsTerminates) {
  // A closed room of perfect mirrors with a pane of glass that splits every ray. Branches double without end and
  // without loss. Weights add up to at most 1, and so does the visible light.
  const auto scene = TestScene::from_text(
      document(R"("eye": [0.3, 0.2, 0.9], "look_at": [-0.4, 0.1, -1])", 60, 16,
               R"({"name": "mirror", "mirror": {}}, {"name": "glass", "dielectric": {"ior": 1.5}})" +
                   also(diffuse("lamp", 0, 1)),
               mesh("mirror", "room.obj") + also(mesh("glass", "pane.obj")) +
                   also(sphere("lamp", "[-0.8, -0.8, -0.8]", 0.15))),
      {{"room.obj", box(-1, 1, -1, 1, -1, 1)}, {"pane.obj", box(-0.9, 0.8, -0.7, 0.9, -0.1, 0.1)}});
  const HalfImages image = scene.render({"whitted:glass=0.5", 1, 0}, 1);
  for (const double value : image.a) {
    ASSERT_GE(value, 0);
    ASSERT_LE(value, 1 + 1e-5);
  }
  EXPECT_GT(mean_of(image, 0).value, 0.005) << "no image of the light is found";
}

TEST(Whitted, ALightPipeReflectsWithoutLoss) {
  // 45° into the end of a bar 1 high and 150 long: 80 total reflections, and Fresnel's loss at both ends. Reflectance
  // at 45° is 0.0502399. Light reflected at the far end is lost on its way back and forth.
  const double slope = std::sqrt(0.5) / std::sqrt(1.5 * 1.5 - 0.5);
  ASSERT_EQ(std::floor(150 * slope + 0.4), 80);
  const std::string glass = R"({"name": "glass", "dielectric": {"ior": 1.5}})";
  const double value =
      seen(R"("eye": [-1, -0.6, 0.03], "look_at": [0, 0.4, 0.03])", glass + also(diffuse("lamp", 0, 1)),
           mesh("glass", "bar.obj") + also(plane_shape("lamp", "[151, 0, 0]", "[-1, 0, 0]")),
           {{"bar.obj", box(0, 150, 0, 1, -0.5, 0.5)}});
  EXPECT_NEAR(value, (1 - 0.0502399) * (1 - 0.0502399), 1e-4);
}

TEST(Whitted, MirrorsReflectAboutSmoothOrFlatNormals) {
  // A corner of a cube with smooth normals. The normal at p is p/|p|, so a camera that looks at the middle sees what is
  // behind it. With flat normals the reflection goes elsewhere.
  const std::string corner = "v 1 0 0\nv 0 1 0\nv 0 0 1\nvn 1 0 0\nvn 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//3\n";
  const auto reflected = [&](const std::string& method) {
    return seen(R"("eye": [1.2, 0.6, 0.2], "look_at": [0.6, 0.3, 0.1])",
                R"({"name": "mirror", "mirror": {}})" + also(diffuse("lamp", 0, 3)),
                mesh("mirror", "corner.obj") + also(sphere("lamp", "[6, 3, 1]", 0.5)), {{"corner.obj", corner}},
                method);
  };
  EXPECT_NEAR(reflected("whitted"), 3, 1e-5);
  EXPECT_EQ(reflected("whitted:flat"), 0);
}

// With one point light and paths of two scatterings, `path` has no randomness either.
TEST(Whitted, MirrorsAndMetalShowWhatThePathTracerSees) {
  for (const char* const kind :
       {R"("mirror": {"reflectance": {"rgb": [0.9, 0.5, 0.2]}})", R"("conductor": {"metal": "gold"})",
        R"("principled": {"base_color": {"rgb": [0.9, 0.5, 0.2]}, "metallic": 1, "roughness": 0})"}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 2, 6], "look_at": [0, 1, 0])", 40, 48,
                 diffuse("floor", 0.7) + fmt::format(R"(, {{"name": "shiny", {}}})", kind),
                 plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(sphere("shiny", "[0, 1, 0]", 1)),
                 R"({"point": {"position": [3, 4, 2], "intensity": {"rgb": [30, 20, 10]}}})"));
    const HalfImages whitted = scene.render({"whitted", 1, 2}, 3), path = scene.render({"path", 1, 2}, 3);
    double sum = 0;
    for (std::size_t i = 0; i < path.a.size(); ++i) {
      ASSERT_NEAR(whitted.a[i], path.a[i], 1e-5) << i;
      ASSERT_NEAR(whitted.b[i], path.b[i], 1e-5) << i;
      sum += path.a[i];
    }
    EXPECT_GT(sum, 0.05 * static_cast<double>(path.a.size()));
  }
}

}  // namespace
}  // namespace lightmill::test
