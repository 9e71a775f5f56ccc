// Memory of compiled scenes, and its limits.
#include <gtest/gtest.h>

#include "common/scene/compiled/transform.h"
#include "tests/support/error_message.h"
#include "tests/support/render_document.h"

namespace lightmill::test {
namespace {

/// A square of side 1 in the plane y = 0, of n² · 2 triangles.
std::string grid_obj(int n) {
  std::string text;
  for (int z = 0; z <= n; ++z) {
    for (int x = 0; x <= n; ++x) {
      text += fmt::format("v {} 0 {}\n", static_cast<double>(x) / n, static_cast<double>(z) / n);
    }
  }
  for (int z = 0; z < n; ++z) {
    for (int x = 0; x < n; ++x) {
      const int corner = z * (n + 1) + x + 1;
      text += fmt::format("f {} {} {} {}\n", corner, corner + n + 1, corner + n + 2, corner + 1);
    }
  }
  return text;
}

/// `copies` objects of one mesh in a row along x, a unit apart, seen from above (up is −z); one pixel each.
std::string row_of_grids(int copies, const std::string& material) {
  std::string objects;
  for (int i = 0; i < copies; ++i) {
    objects += fmt::format(
        R"({}{{"name": "grid {}", "material": "m", "mesh": {{"file": "grid.obj"}},
            "transform": {{"translate": [{}, 0, 0]}}}})",
        i == 0 ? "" : ",", i, i);
  }
  return fmt::format(R"({{"camera": {{"eye": [{0}, {0}, 0.5], "look_at": [{0}, 0, 0.5], "up": [0, 0, -1],
        "vertical_fov_degrees": 0.01}},
      "film": {{"width": 16, "height": 1, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "materials": [{1}], "objects": [{2}]}})",
                     copies / 2.0, material, objects);
}

Result<std::shared_ptr<const CompiledScene>> compile(const LoadedScene& loaded,
                                                     const CompiledScene::ImageDecoder& images = nullptr,
                                                     const CompiledScene::Options& options = {}) {
  return CompiledScene::compile(
      loaded.scene, [&](const Sha256& digest) -> Result<std::string> { return loaded.assets.at(digest); }, images,
      options);
}

// 318² · 2 · 1000 triangles exceed the limit of 200 million. As instances they are held once.
TEST(CompiledMeshes, AThousandCopiesOfALargeMeshAreHeldOnce) {
  const std::map<std::string, std::string> files{{"grid.obj", grid_obj(318)}};
  const std::string white = R"({"name": "m", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}})";
  const auto one = compile(load_text(row_of_grids(1, white), files));
  ASSERT_TRUE(one.ok()) << message_of(one.status());
  const LoadedScene many = load_text(row_of_grids(1000, white), files);
  const auto compiled = compile(many);
  ASSERT_TRUE(compiled.ok()) << message_of(compiled.status());
  EXPECT_GT((*one)->bytes(), 2 * 318 * 318 * 100);
  EXPECT_LT((*compiled)->bytes(), (*one)->bytes() * 11 / 10);
  const HalfImages image = TestScene::from_text(row_of_grids(1000, white), files).render({"preview", 1, 0}, 1);
  for (int i = 0; i < 3 * 16; ++i) {
    EXPECT_NEAR(image.mean(static_cast<std::size_t>(i)), 0.5, 1e-6) << i;  // reflectance times cosine
  }
}

TEST(CompiledMeshes, EmissiveCopiesAreHeldSeparately) {
  const std::map<std::string, std::string> files{{"grid.obj", grid_obj(318)}};
  const std::string emitter =
      R"({"name": "m", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [1, 1, 1]}})";
  const auto compiled = compile(load_text(row_of_grids(1000, emitter), files));
  ASSERT_FALSE(compiled.ok());
  EXPECT_EQ(compiled.status().code(), absl::StatusCode::kResourceExhausted);
  // 988 · 202,248 is below 200 million, 989 · 202,248 is not.
  EXPECT_NE(message_of(compiled.status())
                .find("objects[988] \"grid 988\": the scene has more triangles than the worker's limit of 2000"),
            std::string::npos)
      << message_of(compiled.status());
}

/// Two materials whose textures use one image of 256², or two images.
std::string two_textures(const std::string& other_file) {
  return fmt::format(
      R"({{"camera": {{"eye": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 90}}, "film": {{"width": 1, "height": 1}},
      "textures": [{{"name": "a", "file": "a.png"}}, {{"name": "b", "file": "{}", "filter": "NEAREST"}}],
      "materials": [{{"name": "a", "diffuse": {{"reflectance": {{"texture": "a"}}}}}},
                    {{"name": "b", "diffuse": {{"reflectance": {{"texture": "b"}}}}}}],
      "objects": [{{"material": "a", "sphere": {{"center": [0, 0, 0], "radius": 0.1}}}},
                  {{"material": "b", "sphere": {{"center": [1, 0, 0], "radius": 0.1}}}}]}})",
      other_file);
}
constexpr std::uint64_t kImageBytes = 256 * 256 * 4 * sizeof(float);
/// Its smaller copies: 128² + 64² + … + 1 texels.
constexpr std::uint64_t kPyramidBytes = (256 * 256 - 1) / 3 * 4 * sizeof(float);

std::uint64_t bytes_with_image_of(int side) {
  const auto image = [&](ByteView, const std::string&) -> Result<Texels> {
    const auto values = static_cast<std::size_t>(4 * side * side);
    return Texels{side, side, {}, std::vector<float>(values, 0.5f), true};
  };
  return (*compile(load_text(two_textures("a.png"), {{"a.png", "a"}}), image))->bytes();
}

// Images of 16 bits, converted to linear values once.
TEST(CompiledTextures, CountTowardsTheSceneAndShareTheirImage) {
  EXPECT_EQ(bytes_with_image_of(256) - bytes_with_image_of(1), kImageBytes + kPyramidBytes - 4 * sizeof(float));
}

TEST(CompiledTextures, HaveACommonLimit) {
  const auto image = [](ByteView, const std::string&) -> Result<Texels> {
    return Texels{256, 256, {}, std::vector<float>(256 * 256 * 4, 0.5f), false};
  };
  CompiledScene::Options options;
  options.max_texture_bytes = kImageBytes + kPyramidBytes;
  EXPECT_TRUE(compile(load_text(two_textures("a.png"), {{"a.png", "a"}}), image, options).ok());
  const auto two = compile(load_text(two_textures("b.png"), {{"a.png", "a"}, {"b.png", "b"}}), image, options);
  ASSERT_FALSE(two.ok());
  EXPECT_EQ(message_of(two.status()),
            "textures[1] \"b\": the scene's images need more than the worker's limit of 0.001302 GiB (--images-gib)");
}

TEST(CompiledMeshes, TheTriangleLimitCountsInstancesOnce) {
  Mesh strip;  // enough triangles for an instance
  for (std::uint32_t i = 0; i < 66; ++i) {
    strip.positions.push_back({0.1 * i, i % 2 * 1.0, 0});
  }
  for (std::uint32_t i = 0; i < 64; ++i) {
    strip.triangles.push_back({i, i + 1, i + 2});
  }
  const std::string bytes = encode_mesh(strip);
  Scene scene;
  scene.materials.emplace_back().name = "grey";
  for (int i = 0; i < 3; ++i) {
    scene.objects.push_back({fmt::format("strip {}", i), 0, MeshShape{"strip.obj", sha256(bytes)}});
  }
  const auto assets = [&](const Sha256&) -> Result<std::string> { return bytes; };
  CompiledScene::Options options;
  options.max_triangles = 64;
  EXPECT_TRUE(CompiledScene::compile(scene, assets, nullptr, options).ok());
  options.max_triangles = 63;
  const auto refused = CompiledScene::compile(scene, assets, nullptr, options);
  EXPECT_EQ(refused.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(refused.status()),
            "objects[0] \"strip 0\": the scene has more triangles than the worker's limit of 63 "
            "(--scene-triangles; instances of a mesh count once)");
}

/// A ball under one light.
std::string ball_under(const std::string& light, const std::string& textures = "[]",
                       const std::string& reflectance = R"({"rgb": [0.5, 0.5, 0.5]})") {
  return fmt::format(
      R"({{"camera": {{"eye": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 90}}, "film": {{"width": 1, "height": 1}},
      "textures": {}, "materials": [{{"name": "a", "diffuse": {{"reflectance": {}}}}}],
      "objects": [{{"material": "a", "sphere": {{"center": [0, 0, 0], "radius": 0.1}}}}], "lights": {}}})",
      textures, reflectance, light);
}

// An image of 256 · 128 pixels takes 28 bytes a pixel from floats, and 24 with 8 bits a channel. Each row takes 4 bytes
// more for the ends of sums.
TEST(CompiledEnvironment, CountsTheBytesOfItsPreparation) {
  const std::string sky = R"([{"name": "sky", "environment": {"file": "sky.exr"}}])";
  constexpr std::uint64_t kPixels = 256 * 128;
  const auto compiled = [&](const CompiledScene::ImageDecoder& images, std::uint64_t limit, const std::string& scene) {
    CompiledScene::Options options;
    options.max_texture_bytes = limit;
    return error_message(compile(load_text(scene, {{"sky.exr", "sky"}, {"a.png", "a"}}), images, options));
  };
  const auto floats = [](ByteView, const std::string&) -> Result<Texels> {
    return Texels{256, 128, {}, std::vector<float>(4 * kPixels, 0.5f), false};
  };
  const auto bytes = [](ByteView, const std::string&) -> Result<Texels> {
    return Texels{256, 128, std::vector<std::uint32_t>(kPixels, 0xff808080), {}, true};
  };
  const std::string refused = "lights[0] \"sky\": the scene's images need more than the worker's limit of ";
  EXPECT_EQ(compiled(floats, 28 * kPixels, ball_under(sky)), "no error");
  EXPECT_TRUE(compiled(floats, 28 * kPixels - 1, ball_under(sky)).starts_with(refused));
  EXPECT_EQ(compiled(bytes, 24 * kPixels + 4 * 128, ball_under(sky)), "no error");
  EXPECT_TRUE(compiled(bytes, 24 * kPixels + 4 * 128 - 1, ball_under(sky)).starts_with(refused));
  // Together with textures: 4 bytes a pixel, and 10,923 pixels of smaller copies.
  const std::string textured = ball_under(sky, R"([{"name": "t", "file": "a.png"}])", R"({"texture": "t"})");
  constexpr std::uint64_t kTogether = 28 * kPixels + 4 * (128 + 10'923);
  EXPECT_EQ(compiled(bytes, kTogether, textured), "no error");
  EXPECT_TRUE(compiled(bytes, kTogether - 1, textured).starts_with(refused));
}

TEST(CompiledEnvironment, LimitsTheSidesOfItsImage) {
  const auto strip = [](ByteView, const std::string&) -> Result<Texels> {
    return Texels{65537, 1, std::vector<std::uint32_t>(65537, 0xff808080), {}, true};
  };
  const auto result = compile(
      load_text(ball_under(R"([{"name": "sky", "environment": {"file": "sky.png"}}])"), {{"sky.png", "s"}}), strip);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(message_of(result.status()),
            "lights[0] \"sky\": sky.png: an environment may have at most 65536 pixels on a side, got 65537x1");
}

// A profile that is the same all round has 2 · 2 values. A file that two lights name counts once.
TEST(CompiledProfiles, HaveACommonLimit) {
  const auto ies = [](const std::string& candela) {
    return fmt::format("IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 1 1 2 0.1 0.2 0\n1 1 100\n0 90\n0\n{}\n", candela);
  };
  const std::map<std::string, std::string> files{{"a.ies", ies("8 2")}, {"b.ies", ies("4 1")}};
  const auto lights = [](const std::string& third) {
    const auto light = [](int name, const std::string& file) {
      return fmt::format(R"({{"name": "{}", "ies": {{"position": [0, 2, 0], "file": "{}"}}}})", name, file);
    };
    return fmt::format("[{}, {}, {}]", light(1, "a.ies"), light(2, "a.ies"), light(3, third));
  };
  CompiledScene::Options options;
  options.max_ies_values = 7;
  EXPECT_TRUE(compile(load_text(ball_under(lights("a.ies")), files), nullptr, options).ok());
  const auto two = compile(load_text(ball_under(lights("b.ies")), files), nullptr, options);
  ASSERT_FALSE(two.ok());
  EXPECT_EQ(message_of(two.status()), "lights[2] \"3\": the scene's IES profiles have more than the limit of 7 values");
}

// √(s²) is s in IEEE arithmetic, and scaling by powers of two is exact.
TEST(Affine, ASimilarityScalesByExactlyItsFactor) {
  for (const double s : {0.1, 1 / 3.0, 1.7, 3.0, 1e7 / 3, 0x1p-600, 1.1e-300}) {
    for (const double sign : {1.0, -1.0}) {
      // Turned by a quarter about z, and mirrored or not.
      const Affine map(Transform{{{0, -s, 0, 5}, {s, 0, 0, 6}, {0, 0, sign * s, 7}}});
      EXPECT_EQ(map.similarity_scale(), s) << s;
    }
  }
  const Affine turned(Transform{{{2 * 0.6, -2 * 0.8, 0, 0}, {2 * 0.8, 2 * 0.6, 0, 0}, {0, 0, 2, 0}}});
  EXPECT_DOUBLE_EQ(turned.similarity_scale(), 2);
}

}  // namespace
}  // namespace lightmill::test
