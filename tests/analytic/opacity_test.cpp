// Surfaces with an opacity below 1, whose share of the light is known exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "common/base/check.h"
#include "common/film/layers.h"
#include "common/image/texels.h"
#include "common/methods/spec/method_spec.h"
#include "common/sampling/sobol.h"
#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// A black material that emits and has this opacity. `fields` are further ones of the opacity, each after a comma.
std::string card(const std::string& name, double opacity, double emission = 0, double reflectance = 0,
                 const std::string& fields = "") {
  return fmt::format(
      R"({{"name": "{}", "diffuse": {{"reflectance": {}}}, "emission": {}, "opacity": {{"value": {}{}}}}})", name,
      gray(reflectance), gray(emission), opacity, fields);
}
/// A square of side 10 in the plane z, facing +z.
std::string upright(double z, double left = -5) {
  return polygon({{left, -5, z}, {5, -5, z}, {5, 5, z}, {left, 5, z}});
}
const std::string kFront = R"("eye": [0.3, 0.2, 6], "look_at": [0, 0, 0])";

/// 2×1 texels: black with alpha 0, and white with alpha 1.
Result<Texels> half_image(ByteView /*bytes*/, const std::string& /*name*/) {
  std::vector<std::uint32_t> bytes{0x00000000, 0xffffffff};
  return Texels{2, 1, std::move(bytes), {}, false};
}
std::string with_texture(std::string document) {
  document.insert(1, R"("textures": [{"name": "half", "file": "half.png", "filter": "NEAREST", "wrap": "CLAMP"}], )");
  return document;
}
const std::string kMapped = R"(, "map": {"texture": "half", "channel": "A"})";

const std::vector<std::string> kMethods{
    "path", "caustic:photons=64", "vcm:photons=64", "ppm:photons=64", "raycast", "whitted", "preview"};

void expect_everywhere(const HalfImages& image, double exact, const std::string& method) {
  for (const std::vector<double>* half : {&image.a, &image.b}) {
    const auto [low, high] = std::ranges::minmax(*half);
    EXPECT_FLOAT_EQ(low, exact) << method;
    EXPECT_FLOAT_EQ(high, exact) << method;
  }
}

// Four samples of a half are stratified, so exactly two of them pass.
TEST(Opacity, AHalfTransparentCardShowsExactlyHalfOfALightByEveryMethod) {
  const auto scene = TestScene::from_text(
      document(kFront, 40, 8,
               diffuse("lamp", 0, 1) + also(card("card", 0.5)) + also(named("chrome", R"("mirror": {})")),
               mesh("lamp", "lamp.obj") + also(mesh("card", "card.obj")) + also(sphere("chrome", "[0, 0, 20]", 1))),
      {{"lamp.obj", upright(0)}, {"card.obj", upright(1)}});
  for (const std::string& method : kMethods) {
    expect_everywhere(scene.render({method, 1, 0}, 3), 0.5, method);
  }
}

// The card i cards from the front stops 2^-(i+1) of the light, and three cards pass 2^-3.
TEST(Opacity, EachOfStackedCardsShowsItsShare) {
  const auto scene = TestScene::from_text(
      document(
          kFront, 40, 8,
          diffuse("lamp", 0, 8) + also(card("a", 0.5, 1)) + also(card("b", 0.5, 2)) + also(card("c", 0.5, 4)),
          mesh("b", "b.obj") + also(mesh("lamp", "lamp.obj")) + also(mesh("c", "c.obj")) + also(mesh("a", "a.obj"))),
      {{"lamp.obj", upright(0)}, {"a.obj", upright(1)}, {"b.obj", upright(1.5)}, {"c.obj", upright(2)}});
  for (const std::string& method : kMethods) {
    expect_everywhere(scene.render({method, 2, 0}, 4), 4 / 2.0 + 2 / 4.0 + 1 / 8.0 + 8 / 8.0, method);
  }
}

TEST(Opacity, ManyCardsPassAPowerOfTheirTransparency) {
  std::string objects = mesh("lamp", "lamp.obj");
  std::map<std::string, std::string> files{{"lamp.obj", upright(0)}};
  constexpr int kCards = 20;
  for (int i = 0; i < kCards; ++i) {
    const std::string file = fmt::format("{}.obj", i);
    objects += also(mesh("card", file));
    files[file] = upright(0.5 + 0.1 * i);
  }
  const auto scene =
      TestScene::from_text(document(kFront, 40, 16, diffuse("lamp", 0, 1) + also(card("card", 0.1)), objects), files);
  for (const std::string method : {"path", "whitted"}) {
    expect_answer(mean_of(scene.render({method, 3, 0}, 9), 0), std::pow(0.9, kCards), 5e-3);
  }
}

/// The mean over a picture or meter, and its standard error from 8 seeds: pixels share photons, so their own errors are
/// not independent.
Estimate over_seeds(const TestScene& scene, MethodSettings settings, std::uint32_t level, PixelRect rect = {}) {
  constexpr int kSeeds = 8;
  double sum = 0, squares = 0;
  for (int i = 0; i < kSeeds; ++i) {
    ++settings.seed;
    const double value = mean_of(scene.render(settings, level, rect), 1).value;
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kSeeds;
  return {mean, std::sqrt(std::max(squares / kSeeds - mean * mean, 0.0) / (kSeeds - 1))};
}

/// A white floor under a light. A black card of opacity 0.25 is between them, or not.
TestScene shaded(bool with_card, const std::string& materials, const std::string& objects, const std::string& lights) {
  std::string text =
      document(R"("eye": [0.1, 0.5, 1], "look_at": [0, 0, 0])", 20, 16,
               diffuse("floor", 1) + also(card("card", 0.25)) + materials,
               mesh("floor", "floor.obj") + (with_card ? also(mesh("card", "card.obj")) : "") + objects, lights);
  text.insert(
      1,
      R"("meters": [{"name": "floor", "patch": {"corner": [-0.5, 0.1, -0.5], "edge1": [0, 0, 1], "edge2": [1, 0, 0]}}], )");
  return TestScene::from_text(text, {{"floor.obj", plane(6, 0, true)},
                                     {"card.obj", horizontal_square(6, 2, true)},
                                     {"lamp.obj", horizontal_square(1, 4, false)}});
}

/// The share of the floor's light that the card lets through, in the picture and on a meter. `precision` 0: nothing is
/// drawn, so it is the same in each pixel.
void expect_shadow(const std::string& materials, const std::string& objects, const std::string& lights,
                   const std::vector<std::string>& methods, std::uint32_t level, double precision) {
  const TestScene open = shaded(false, materials, objects, lights), dim = shaded(true, materials, objects, lights);
  for (const std::string& method : methods) {
    const bool metered = method != "raycast" && method != "whitted";
    for (const PixelRect& rect : {PixelRect{}, meter_rect(0)}) {
      if (rect.width > 0 && !metered) {
        continue;
      }
      const MethodSettings settings{method, 4, metered ? 1u : 0u};
      if (precision == 0) {
        const HalfImages before = open.render(settings, level, rect), after = dim.render(settings, level, rect);
        for (std::size_t i = 0; i < before.a.size(); ++i) {
          ASSERT_GT(before.a[i], 0) << method << " " << i;
          ASSERT_NEAR(after.a[i], 0.75 * before.a[i], 1e-5 * before.a[i]) << method << " " << i;
        }
        continue;
      }
      const Estimate before = over_seeds(open, settings, level, rect), after = over_seeds(dim, settings, level, rect);
      ASSERT_GT(before.value, 0) << method;
      const double error = std::hypot(after.standard_error, 0.75 * before.standard_error);
      EXPECT_LT(error, precision * before.value) << method << " is too noisy to compare";
      EXPECT_NEAR(after.value, 0.75 * before.value, 5 * error + kRounding * before.value) << method;
    }
  }
}

TEST(Opacity, AShadowIsAsDeepAsTheOpacity) {
  const std::string bulb = R"({"point": {"position": [0, 4, 0], "intensity": {"rgb": [9, 9, 9]}}})";
  expect_shadow("", "", bulb, {"path", "raycast", "whitted"}, 1, 0);
  expect_shadow("", "", bulb, {"vcm:photons=4000", "ppm:photons=8000"}, 4, 2e-2);
}

TEST(Opacity, ASoftShadowIsAsDeepAsTheOpacity) {
  expect_shadow(also(diffuse("lamp", 0, 5)), also(mesh("lamp", "lamp.obj")), "",
                {"path", "vcm:photons=4000", "ppm:photons=8000"}, 4, 2e-2);
}

// Glass elsewhere makes paths track media, which is other code.
TEST(Opacity, ShadowsAreTheSameWhereMediaAreTracked) {
  const std::string bulb = R"({"point": {"position": [0, 4, 0], "intensity": {"rgb": [9, 9, 9]}}})";
  const std::string glass =
      also(R"({"name": "glass", "dielectric": {"ior": 1.5}, "interior": {"absorption": {"rgb": [1, 1, 1]}}})");
  expect_shadow(glass, also(sphere("glass", "[5, 1, 5]", 0.5)), bulb, {"path", "raycast", "whitted"}, 1, 0);
}

// A white card in uniform light cannot be seen, however often light meets it.
TEST(Opacity, AWhiteCardInAFurnaceIsInvisible) {
  const auto scene = TestScene::from_text(document(
      R"("eye": [0.1, 3, 0.3], "look_at": [0, 0, 0])", 30, 16, diffuse("sky", 0, 1) + also(card("card", 0.5, 0, 1)),
      sphere("sky", "[0, 0, 0]", 10, true) + also(plane_shape("card", "[0, 0, 0]", "[0, 1, 0]"))));
  for (const std::string method : {"path", "vcm:photons=4000", "ppm:photons=20000"}) {
    expect_answer(over_seeds(scene, {method, 5, 0}, 4), 1, 1e-2);
  }
}

// Casters and a receiver behind a card: `caustic` gathers and splats photons there.
TEST(Opacity, CausticsThroughACardAreAsDimAsTheOpacity) {
  const auto scene = [](bool with_card) {
    return TestScene::from_text(
        document(R"("eye": [0, 1.2, 3], "look_at": [0, 0.3, 0])", 40, 16,
                 diffuse("floor", 0.8) + also(card("card", 0.25)) + also(named("glass", R"("dielectric": {})")),
                 mesh("floor", "floor.obj") + also(sphere("glass", "[0, 0.7, 0]", 0.5)) +
                     (with_card ? also(mesh("card", "card.obj")) : ""),
                 R"({"point": {"position": [0, 4, 0], "intensity": {"rgb": [9, 9, 9]}}})"),
        {{"floor.obj", plane(20, 0, true)}, {"card.obj", horizontal_square(12, 3, true)}});
  };
  for (const std::string method : {"caustic:photons=4000", "vcm:photons=4000", "ppm:photons=4000"}) {
    const Estimate after = over_seeds(scene(true), {method, 6, 0}, 3),
                   before = over_seeds(scene(false), {method, 16, 0}, 3);
    const double error = std::hypot(after.standard_error, 0.75 * before.standard_error);
    EXPECT_LT(error, 2e-2 * before.value) << method;
    EXPECT_NEAR(after.value, 0.75 * before.value, 5 * error + 2e-3 * before.value) << method;
  }
}

// A half-transparent emitter of twice the radiance gives as much light as an opaque one. An emitter whose half is cut out
// does so, too.
TEST(Opacity, AnEmitterLightsByItsOpacity) {
  struct Case {
    double emission, opacity;
    std::string fields;
  };
  for (const Case& c : {Case{1, 1, ""}, {2, 0.5, ""}, {2, 1, R"(, "mode": "MASK")" + kMapped}}) {
    const auto scene = TestScene::from_text(
        with_texture(document(R"("eye": [0.2, 0.3, 1], "look_at": [0, 0, 0])", 0.01, 8,
                              diffuse("floor", 1) + also(card("lamp", c.opacity, c.emission, 0, c.fields)),
                              mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj")))),
        {{"floor.obj", plane(20, 0, true)},
         {"half.png", "x"},
         // Its map is a half, and the halves light the floor below the middle alike.
         {"lamp.obj", "v -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"}},
        half_image);
    // Form factor of a square of side 2 at distance 1, seen from below its middle (Siegel & Howell, C-4).
    const double s = std::sqrt(2.0), exact = 4 / s * std::atan(1 / s) / M_PI;
    expect_answer(mean_of(scene.render({"path", 7, 1}, 12), 0), exact, 1e-2);
  }
}

TEST(Opacity, AMaskCutsExactly) {
  const auto picture = [](const std::string& material, const std::string& obj, const std::string& method) {
    return TestScene::from_text(with_texture(document(R"("eye": [0, 0, 6], "look_at": [0, 0, 0])", 60, 16,
                                                      diffuse("lamp", 0, 1) + also(material),
                                                      mesh("lamp", "lamp.obj") + also(mesh("card", "card.obj")))),
                                {{"lamp.obj", upright(0)}, {"card.obj", obj}, {"half.png", "x"}}, half_image)
        .render({method, 8, 0}, 2);
  };
  const std::string whole =
      "v -5 -5 1\nv 5 -5 1\nv 5 5 1\nv -5 5 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  for (const std::string& method : kMethods) {
    const HalfImages cut = picture(card("card", 0.6, 3), upright(1, 0), method);
    HalfImages opaque = picture(card("card", 1, 3), upright(1, 0), method);
    const HalfImages masked = picture(card("card", 0.6, 3, 0, R"(, "mode": "MASK")" + kMapped), whole, method);
    EXPECT_EQ(masked.a, opaque.a) << method;
    EXPECT_EQ(masked.b, opaque.b) << method;
    EXPECT_NE(masked.a, cut.a) << method;
    // 0.6 is below this cutoff, so nothing is left of the card.
    expect_everywhere(picture(card("card", 0.6, 3, 0, R"(, "mode": "MASK", "cutoff": 0.7)"), whole, method), 1, method);
  }
}

/// All that a method renders of a scene: every layer and meter.
std::vector<float> film_of(const TestScene& scene, const std::string& method) {
  const auto made = make_method(scene.compiled(), {method, 9, 0, all_layers(parse_method(method)->name, {})});
  LM_CHECK(made.ok(), "{}", message_of(made.status()));
  const auto workspace = (*made)->make_workspace();
  std::vector<float> values = (*made)->render({0, 0, 24, 24}, {2, 0}, *workspace).values;
  if (!scene.scene().meters.empty() && method_reads_meters(parse_method(method)->name)) {
    const std::vector<float> meter = (*made)->render(meter_rect(0), {1, 0}, *workspace).values;
    values.insert(values.end(), meter.begin(), meter.end());
  }
  return values;
}

const std::vector<std::string> kAllMethods{
    "path", "caustic:photons=500",   "vcm:photons=500", "ppm:photons=500", "raycast", "whitted", "preview",
    "ao",   "photon-map:photons=500"};

/// A room with every kind of path, and `more` at the end. `interior`: of the glass.
TestScene room(const std::string& materials, const std::string& more, const std::map<std::string, std::string>& files,
               const std::string& interior = "") {
  std::string text = document(
      R"("eye": [0.3, 1.2, 4], "look_at": [0, 0.8, 0])", 50, 24,
      diffuse("white", 0.7) + also(fmt::format(R"({{"name": "glass", "dielectric": {{}}{}}})", interior)) +
          also(named("chrome", R"("mirror": {})")) + also(diffuse("lamp", 0.2, 4)) +
          also(named("gloss", R"("phong": {"specular": {"rgb": [0.5, 0.5, 0.5]}})")) + materials,
      mesh("white", "floor.obj") + also(sphere("glass", "[-0.8, 0.6, 0]", 0.5)) +
          also(sphere("chrome", "[0.8, 0.6, -0.5]", 0.5)) + also(sphere("gloss", "[0.2, 0.3, 0.8]", 0.3)) +
          also(sphere("lamp", "[0, 2.4, 0]", 0.3)) + more,
      R"({"point": {"position": [-1, 2, 1], "intensity": {"rgb": [1, 1, 2]}}}, {"environment": {"radiance": {"rgb": [0.1, 0.1, 0.1]}}})");
  text.insert(
      1, R"("meters": [{"name": "m", "patch": {"corner": [-1, 0.1, -1], "edge1": [0, 0, 1], "edge2": [1, 0, 0]}}], )");
  std::map<std::string, std::string> all = files;
  all["floor.obj"] = plane(8, 0, true);
  return TestScene::from_text(text, all);
}

TEST(Opacity, ASurfaceOfOpacity0IsNotThere) {
  const std::map<std::string, std::string> files{
      {"card.obj", polygon({{-1.5, 0.05, 0.5}, {1.5, 0.05, 0.6}, {1.5, 1.9, 0.7}, {-1.5, 1.9, 0.4}})}};
  const std::string ghosts = also(mesh("ghost", "card.obj")) + also(sphere("ghost", "[0, 0.9, 1.5]", 0.6));
  for (const std::string interior : {"", R"(, "interior": {"absorption": {"rgb": [0.5, 1, 2]}})"}) {
    const TestScene without = room("", "", {}, interior),
                    with = room(also(card("ghost", 0, 0, 0.5)), ghosts, files, interior);
    for (const std::string& method : kAllMethods) {
      EXPECT_TRUE(film_of(with, method) == film_of(without, method)) << method << interior;
    }
  }
}

TEST(Opacity, TheOrderOfPrimitivesChangesNoBit) {
  constexpr int kTriangles = 60;
  std::vector<std::string> faces;
  std::string vertices;
  for (int i = 0; i < kTriangles; ++i) {
    const auto at = [&](int k) {
      return static_cast<double>(mix(static_cast<std::uint32_t>(9 * i + k + 1))) / 0xffffffffu;
    };
    const double x = 3 * at(0) - 1.5, y = 0.1 + 1.8 * at(1), z = 2.4 * at(2) - 0.6;
    for (int corner = 0; corner < 3; ++corner) {
      vertices += fmt::format("v {} {} {}\n", x + (corner == 1 ? 0.9 : 0), y + (corner == 2 ? 0.8 : 0),
                              z + 0.3 * at(3 + corner));
    }
    faces.push_back(fmt::format("f {} {} {}\n", 3 * i + 1, 3 * i + 2, 3 * i + 3));
  }
  const auto scene = [&] {
    return room(also(card("leaves", 0.3, 0, 0.6)), also(mesh("leaves", "leaves.obj")),
                {{"leaves.obj", std::accumulate(faces.begin(), faces.end(), vertices)}});
  };
  const TestScene ordered = scene();
  std::ranges::reverse(faces);
  std::rotate(faces.begin(), faces.begin() + 17, faces.end());
  const TestScene permuted = scene();
  for (const std::string& method : kAllMethods) {
    EXPECT_TRUE(film_of(ordered, method) == film_of(permuted, method)) << method;
  }
}

// A ray is in a packet of eight, or alone.
TEST(Opacity, APixelAloneHasTheSameBits) {
  const TestScene scene = room(also(card("gauze", 0.3, 0, 0.6)), also(mesh("gauze", "a.obj")),
                               {{"a.obj", box(-1.2, 1.1, 0.1, 1.1, 0.2, 1.4)}});
  for (const std::string method : {"path", "vcm:photons=500", "whitted"}) {
    const HalfImages all = scene.render({method, 9, 0}, 1), one = scene.render({method, 9, 0}, 1, {11, 13, 1, 1});
    for (std::size_t channel = 0; channel < 3; ++channel) {
      EXPECT_EQ(one.a[channel], all.a[3 * (13 * 24 + 11) + channel]) << method;
    }
  }
}

// Both hierarchies round hits alike but for the last bits, so only edges may differ.
TEST(Opacity, RaysWithoutAHierarchyPassTheSameSurfaces) {
  const TestScene scene =
      room(also(card("gauze", 0.3, 0, 0.6)), also(mesh("gauze", "a.obj")) + also(mesh("gauze", "b.obj")),
           {{"a.obj", box(-1.2, 0.1, 0.1, 1.1, 0.2, 1.4)}, {"b.obj", box(-0.7, 1.3, 0.2, 0.9, 0.5, 1.7)}});
  const auto depths = [&](bool brute_force) {
    CompiledScene::Options options;
    options.brute_force = brute_force;
    const auto compiled = *CompiledScene::compile(scene.scene(), scene.assets(), nullptr, options);
    const auto made = make_method(compiled, {"preview", 9, 0, *film_layers(std::vector<std::string>{"depth"})});
    const std::vector<float> values = (*made)->render({0, 0, 24, 24}, {0, 0}, *(*made)->make_workspace()).values;
    return std::vector<float>(values.end() - 24 * 24, values.end());
  };
  const std::vector<float> with = depths(false), without = depths(true);
  int different = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    different += std::abs(with[i] - without[i]) > 1e-4f ? 1 : 0;
  }
  EXPECT_LE(different, 1);
  EXPECT_NE(with, std::vector<float>(24 * 24, with[0]));
}

TEST(Opacity, GlassHasNone) {
  EXPECT_NE(refusal(document(kFront, 40, 8, R"({"name": "glass", "dielectric": {}, "opacity": {"value": 0.5}})",
                             sphere("glass", "[0, 0, 0]", 1)))
                .find("materials[0].opacity: light enters this material, so it has no opacity"),
            std::string::npos);
}

}  // namespace
}  // namespace lightmill::test
