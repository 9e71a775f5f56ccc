// Layers that methods write into a film.
#include <gtest/gtest.h>

#include "tests/support/paths.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

constexpr PixelRect kTile{0, 0, 64, 64};

/// One tile's node, by layer.
struct Layers {
  std::vector<LayerSpec> specs;
  SampleRange range;
  std::vector<float> values;

  std::size_t offset(std::string_view name) const {
    std::size_t channel = 0;
    for (const LayerSpec& layer : specs) {
      if (layer.name == name) {
        return channel;
      }
      channel += layer.channels;
    }
    ADD_FAILURE() << name;
    return 0;
  }
  /// The mean over both halves of a summed layer.
  double mean(std::string_view name, std::size_t channel, std::size_t pixel) const {
    const NodeLayout layout(specs);
    const std::size_t pixels = kTile.pixel_count();
    const std::size_t at = (offset(name) + channel) * pixels + pixel;
    return (static_cast<double>(values[at]) + values[layout.summed * pixels + at]) / static_cast<double>(range.count());
  }
  /// A layer's value over samples 0 to 15: a sum, or the nearest.
  float first(std::string_view name, std::size_t channel, std::size_t pixel) const {
    const NodeLayout layout(specs);
    const std::size_t pixels = kTile.pixel_count();
    return values[(2 * layout.summed + offset(name) - layout.summed + channel) * pixels + pixel];
  }
};

Layers render(const test::TestScene& scene, const std::vector<std::string>& names, SampleRange range,
              const std::string& method_name = "path", std::uint32_t max_bounces = 0) {
  Layers out{*film_layers(names), range, {}};
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  EXPECT_TRUE(compiled.ok());
  const auto method = make_method(*compiled, {method_name, 5, max_bounces, out.specs});
  EXPECT_TRUE(method.ok()) << message_of(method.status());
  out.values = (*method)->render(kTile, range, *(*method)->make_workspace()).values;
  return out;
}

test::TestScene balls() {
  return test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(64, 64);
}

/// A quad that fills the picture's left half, in the plane z = x: at x = 0 it is 4 from the camera, at x = −1 it is 5.
test::TestScene tilted_quad() {
  return test::TestScene::from_text(R"({
    "camera": {"eye": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 20},
    "film": {"width": 64, "height": 64, "filter": {"kind": "BOX"}},
    "materials": [{"name": "other", "mirror": {}}, {"name": "paint", "diffuse": {"reflectance": {"rgb": [0.5, 0.25, 0.125]}}}],
    "objects": [{"name": "far", "material": "other", "sphere": {"center": [0, 100, 0], "radius": 1}},
                {"name": "quad", "material": "paint", "mesh": {"file": "quad.obj"}}],
    "lights": [{"point": {"position": [0, 0, 4], "intensity": {"rgb": [1, 1, 1]}}}]})",
                                    {{"quad.obj", "v -4 -4 -4\nv 0 -4 0\nv 0 4 0\nv -4 4 -4\nf 1 2 3 4\n"}});
}

// A shell of index 1 is invisible, in layers as in the picture.
TEST(Layers, BoundariesOfIndexOneAreInvisible) {
  const auto scene = [](bool with_shell) {
    const std::string shell = R"(, {"name": "shell", "material": "air", "sphere": {"center": [0, 0, 0], "radius": 2}})";
    return test::TestScene::from_text(
        R"({"camera": {"eye": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 40},
        "film": {"width": 64, "height": 64},
        "materials": [{"name": "paint", "diffuse": {"reflectance": {"rgb": [0.8, 0.1, 0.1]}}}, {"name": "air", "dielectric": {"ior": 1}}],
        "objects": [{"name": "ball", "material": "paint", "sphere": {"center": [0, 0, 0], "radius": 1}})" +
        (with_shell ? shell : "") +
        R"(], "lights": [{"point": {"position": [0, 3, 4], "intensity": {"rgb": [9, 9, 9]}}}]})");
  };
  for (const char* method : {"path", "caustic", "vcm", "preview", "ao", "raycast", "whitted"}) {
    const Layers plain = render(scene(false), {"albedo", "normal", "depth", "id"}, {2, 0}, method);
    const Layers shelled = render(scene(true), {"albedo", "normal", "depth", "id"}, {2, 0}, method);
    ASSERT_EQ(plain.values.size(), shelled.values.size());
    // The shell changes the frame of reference of leaving rays only by rounding. A pixel can differ where rounding
    // moves the ball's edge across a sample.
    std::size_t different = 0;
    const NodeLayout layout(plain.specs);
    for (std::size_t i = 0; i < plain.values.size(); ++i) {
      const std::size_t plane = i / kTile.pixel_count();
      if (method == std::string("vcm") && plane < 2 * layout.summed && plane % layout.summed < 3) {
        continue;  // photons of beauty are also aimed at the shell, so they differ
      }
      different += std::abs(plain.values[i] - shelled.values[i]) > 1e-3f * (1 + std::abs(plain.values[i])) ? 1 : 0;
    }
    EXPECT_LE(different, plain.values.size() / 1000) << method;
    EXPECT_GT(shelled.mean("albedo", 0, 32 * 64 + 32), 0.79) << method;
    EXPECT_LT(shelled.mean("albedo", 1, 32 * 64 + 32), 0.11) << method;
  }
}

/// Methods that separate light by its path.
class LightLayers : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Methods, LightLayers, testing::Values("path", "caustic", "vcm"),
                         [](const auto& info) { return info.param; });

TEST_P(LightLayers, DirectAndIndirectSumToBeauty) {
  const Layers layers = render(balls(), {"direct", "indirect"}, {5, 0}, GetParam());
  double total_direct = 0, total_indirect = 0;
  for (std::size_t pixel = 0; pixel < 4096; ++pixel) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double beauty = layers.mean("beauty", channel, pixel);
      const double direct = layers.mean("direct", channel, pixel), indirect = layers.mean("indirect", channel, pixel);
      // Sums of some hundred positive terms in different orders.
      EXPECT_NEAR(direct + indirect, beauty, 1e-5 * beauty) << pixel;
      total_direct += direct;
      total_indirect += indirect;
    }
  }
  EXPECT_GT(total_direct, 0);
  EXPECT_GT(total_indirect, 0);
}

/// Lights of every kind of table: some in three groups, some in none.
test::TestScene grouped_lights() {
  return test::TestScene::from_text(R"({
    "camera": {"eye": [0, 0, 2.5], "look_at": [0, 0, 0], "vertical_fov_degrees": 60},
    "film": {"width": 64, "height": 64},
    "materials": [{"name": "wall", "diffuse": {"reflectance": {"rgb": [0.6, 0.5, 0.4]}}}, {"name": "glass", "dielectric": {}},
                  {"name": "a", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [9, 1, 1]}, "light_group": "key"},
                  {"name": "b", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [1, 9, 1]}},
                  {"name": "c", "mirror": {}, "emission": {"rgb": [1, 1, 9]}, "light_group": "fill"}],
    "objects": [{"material": "wall", "plane": {"point": [0, -2.5, 0], "normal": [0, 1, 0.2]}},
                {"material": "glass", "sphere": {"center": [0, -1, 0], "radius": 0.4}},
                {"material": "a", "sphere": {"center": [1, 1, 0], "radius": 0.3}},
                {"material": "b", "sphere": {"center": [-1, 1, 0], "radius": 0.3}},
                {"material": "c", "sphere": {"center": [0, 0, -1], "radius": 0.3}}],
    "lights": [{"point": {"position": [0, 2, 0], "intensity": {"rgb": [2, 2, 2]}}, "group": "fill"},
               {"point": {"position": [0, -2, 1], "intensity": {"rgb": [1, 1, 1]}}},
               {"cosine_power": {"position": [0, 2, 1], "direction": [0, -1, 0], "intensity": {"rgb": [1, 2, 1]}}, "group": "key"},
               {"directional": {"direction": [1, -1, -1], "irradiance": {"rgb": [1, 1, 1]}}, "group": "fill"},
               {"environment": {"radiance": {"rgb": [0.3, 0.5, 0.7]}}, "group": "sky"}]})");
}

TEST_P(LightLayers, GroupsAndTheRestSumToBeauty) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"light:key", "light:fill"}, {"direct", "light:fill", "light:sky"}, {"light:fill"}}) {
    const Layers layers = render(grouped_lights(), names, {4, 0}, GetParam());
    for (std::size_t pixel = 0; pixel < 4096; ++pixel) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const double beauty = layers.mean("beauty", channel, pixel);
        double sum = layers.mean("light:rest", channel, pixel);
        for (const std::string& name : names) {
          sum += name == "direct" ? 0 : layers.mean(name, channel, pixel);
        }
        EXPECT_NEAR(sum, beauty, 1e-5 * beauty) << pixel;
      }
    }
  }
}

TEST_P(LightLayers, AGroupEqualsThePictureWithOnlyItsLights) {
  const Layers grouped = render(grouped_lights(), {"light:key", "light:fill", "light:sky"}, {6, 0}, GetParam());
  const auto alone = [](const std::string& group) {
    test::TestScene original = grouped_lights();
    Scene scene = original.scene();
    for (Material& material : scene.materials) {
      material.emission = material.light_group == group ? material.emission : TexturedColor{};
    }
    std::erase_if(scene.lights, [&](const Light& light) { return light.group != group; });
    const auto compiled = CompiledScene::compile(scene, original.assets());
    Layers out{*film_layers(std::vector<std::string>{}), {6, 0}, {}};
    const auto method = make_method(*compiled, {GetParam(), 6, 0, out.specs});
    out.values = (*method)->render(kTile, out.range, *(*method)->make_workspace()).values;
    return out;
  };
  for (const auto& [layer, group] : {std::pair<std::string, std::string>{"light:key", "key"},
                                     {"light:fill", "fill"},
                                     {"light:sky", "sky"},
                                     {"light:rest", ""}}) {
    const Layers expected = alone(group);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      double sum = 0, expected_sum = 0;
      for (std::size_t pixel = 0; pixel < 4096; ++pixel) {
        sum += grouped.mean(layer, channel, pixel);
        expected_sum += expected.mean("beauty", channel, pixel);
      }
      EXPECT_NEAR(sum, expected_sum, 0.02 * expected_sum) << layer;  // their standard error is below 0.3 %
      EXPECT_GT(sum, 0);
    }
  }
}

TEST(Layers, AnUnknownLightGroupIsNamed) {
  const auto scene = grouped_lights();
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  const auto method = make_method(*compiled, {"path", 0, 0, *film_layers(std::vector<std::string>{"light:kye"})});
  EXPECT_EQ(message_of(method.status()), "the scene has no light group \"kye\". It has fill, key, sky");
}

TEST_P(LightLayers, ChangeNoBitOfBeauty) {
  for (const SampleRange range : {SampleRange{3, 0}, {2, 20}}) {
    const Layers plain = render(balls(), {}, range, GetParam());
    const Layers with = render(balls(), {"direct", "indirect", "albedo", "normal", "depth", "id"}, range, GetParam());
    const std::size_t half = 3 * 4096;
    const std::size_t half_b = NodeLayout(with.specs).summed * 4096;
    EXPECT_TRUE(std::equal(plain.values.begin(), plain.values.begin() + half, with.values.begin()));
    EXPECT_TRUE(std::equal(plain.values.begin() + half, plain.values.end(), with.values.begin() + half_b));
  }
}

TEST_P(LightLayers, LightScatteredOnceIsDirect) {
  // After one scattering nothing is indirect. With more scatterings the direct light stays the same.
  const Layers one = render(balls(), {"direct", "indirect"}, {4, 0}, GetParam(), 1);
  const Layers all = render(balls(), {"direct", "indirect"}, {4, 0}, GetParam());
  for (std::size_t pixel = 0; pixel < 4096; ++pixel) {
    EXPECT_EQ(one.mean("indirect", 0, pixel), 0);
    EXPECT_EQ(one.mean("direct", 1, pixel), one.mean("beauty", 1, pixel));
    EXPECT_EQ(all.mean("direct", 1, pixel), one.mean("direct", 1, pixel));
  }
}

class SurfaceLayers : public testing::TestWithParam<std::string> {};

TEST_P(SurfaceLayers, ShowTheFirstVisibleSurface) {
  const Layers layers = render(tilted_quad(), {"albedo", "normal", "features", "depth", "id"}, {5, 0}, GetParam());
  const double pixel_size = 2 * std::tan(10 * M_PI / 180) / 64;  // at distance 1
  for (const std::size_t row : {5u, 40u}) {
    for (const std::size_t column : {3u, 20u, 30u}) {
      const std::size_t pixel = row * 64 + column;
      EXPECT_NEAR(layers.mean("albedo", 0, pixel), 0.5, 1e-6);
      EXPECT_NEAR(layers.mean("albedo", 2, pixel), 0.125, 1e-6);
      // Sixteen times (1, 0, 1)/sqrt(2) turned to the camera: it faces +z.
      EXPECT_NEAR(layers.first("normal", 0, pixel), -16 * std::sqrt(0.5), 1e-4);
      EXPECT_NEAR(layers.first("normal", 1, pixel), 0, 1e-4);
      EXPECT_NEAR(layers.first("normal", 2, pixel), 16 * std::sqrt(0.5), 1e-4);
      // A ray through x = t·z' meets z = x where 4 − z' = t·z': z' = 4/(1 + t), less to the right. It does not depend
      // on the row, as a distance along the ray would. The nearest lies near the pixel's right edge.
      const double t_right = (static_cast<double>(column) + 1 - 32) * pixel_size;
      const double t_left = (static_cast<double>(column) - 32) * pixel_size;
      EXPECT_GE(layers.first("depth", 0, pixel), 4 / (1 - std::abs(t_right)) - 1e-4);
      EXPECT_LE(layers.first("depth", 0, pixel), 4 / (1 - std::abs(t_left)) + 1e-4);
      // Each half has eight samples.
      for (const std::size_t half : {0u, 10u}) {
        EXPECT_NEAR(layers.first("features", half, pixel), 8 * 0.5, 1e-6);
        EXPECT_NEAR(layers.first("features", half + 2, pixel), 8 * 0.125, 1e-6);
        EXPECT_NEAR(layers.first("features", half + 3, pixel), -8 * std::sqrt(0.5), 1e-4);
        EXPECT_NEAR(layers.first("features", half + 5, pixel), 8 * std::sqrt(0.5), 1e-4);
        const double inverse = static_cast<double>(layers.first("features", half + 6, pixel)) / 8;
        EXPECT_GE(inverse, (1 - std::abs(t_left)) / 4 - 1e-6);
        EXPECT_LE(inverse, (1 - std::abs(t_right)) / 4 + 1e-6);
        EXPECT_NEAR(layers.first("features", half + 7, pixel), 8 * (0.25 + 0.0625 + 0.015625), 1e-5);
        EXPECT_NEAR(layers.first("features", half + 8, pixel), 8, 1e-4);
        EXPECT_NEAR(layers.first("features", half + 9, pixel), 8 * inverse * inverse, 1e-3);
      }
      for (std::size_t sample = 0; sample < 16; ++sample) {
        EXPECT_EQ(layers.first("id", sample, pixel), 2.0f);  // objects[1]
      }
    }
    const std::size_t sky = row * 64 + 50;
    EXPECT_EQ(layers.mean("albedo", 0, sky), 0);
    EXPECT_EQ(layers.first("normal", 2, sky), 0);
    for (std::size_t channel = 0; channel < 20; ++channel) {
      EXPECT_EQ(layers.first("features", channel, sky), 0);
    }
    EXPECT_EQ(layers.first("depth", 0, sky), 0);
    EXPECT_EQ(layers.first("id", 15, sky), 0);
  }
}
TEST(Layers, FlatMethodsGiveTheGeometricNormal) {
  const auto scene = test::TestScene::from_text(R"({
    "camera": {"eye": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 20},
    "film": {"width": 64, "height": 64, "filter": {"kind": "BOX"}},
    "materials": [{"name": "paint", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}}],
    "objects": [{"name": "quad", "material": "paint", "mesh": {"file": "quad.obj"}}]})",
                                                {{"quad.obj",
                                                  "v -4 -4 -4\nv 4 -4 4\nv 4 4 4\nv -4 4 -4\nvn 0 0 1\n"
                                                  "f 1//1 2//1 3//1 4//1\n"}});
  for (const char* const method : {"raycast", "raycast:flat", "whitted", "whitted:flat"}) {
    const Layers layers = render(scene, {"normal"}, {4, 0}, method);
    const double x = std::string_view(method).ends_with("flat") ? -std::sqrt(0.5) : 0;
    EXPECT_NEAR(layers.first("normal", 0, 20 * 64 + 20), 16 * x, 1e-4) << method;
    EXPECT_NEAR(layers.first("normal", 2, 20 * 64 + 20), 16 * std::sqrt(1 - x * x), 1e-4) << method;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, SurfaceLayers, testing::Values("path", "caustic", "vcm", "preview"),
                         [](const auto& info) { return info.param; });

TEST(Layers, AnUnsupportedLayerIsRefused) {
  const auto scene = balls();
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  const auto method = make_method(*compiled, {"preview", 0, 0, *film_layers(std::vector<std::string>{"direct"})});
  EXPECT_EQ(message_of(method.status()),
            "method preview has no layer \"direct\". It has albedo, normal, features, depth, id");
}

}  // namespace
}  // namespace lightmill
