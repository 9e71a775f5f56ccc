// What a scene needs in memory once it is compiled, and what is refused.
#include <gtest/gtest.h>

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

// 318² · 2 · 1000 triangles are more than the limit of 200 million, but as instances they are held once.
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

TEST(CompiledMeshes, CopiesThatGlowAreHeldOneByOne) {
  const std::map<std::string, std::string> files{{"grid.obj", grid_obj(318)}};
  const std::string lamp =
      R"({"name": "m", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [1, 1, 1]}})";
  const auto compiled = compile(load_text(row_of_grids(1000, lamp), files));
  ASSERT_FALSE(compiled.ok());
  EXPECT_EQ(compiled.status().code(), absl::StatusCode::kResourceExhausted);
  // 988 · 202,248 are below 200 million, 989 are not.
  EXPECT_NE(message_of(compiled.status()).find("objects[988] \"grid 988\": the scene has more than the limit of 2000"),
            std::string::npos)
      << message_of(compiled.status());
}

/// Two materials with textures of one image, 256², or of two.
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

std::uint64_t bytes_with_image_of(int side) {
  const auto image = [&](ByteView, const std::string&) -> Result<Texels> {
    const auto values = static_cast<std::size_t>(4 * side * side);
    return Texels{side, side, {}, std::vector<float>(values, 0.5f), true};
  };
  return (*compile(load_text(two_textures("a.png"), {{"a.png", "a"}}), image))->bytes();
}

// Images of 16 bits, which are made linear once.
TEST(CompiledTextures, CountInTheSceneAndShareTheirImage) {
  EXPECT_EQ(bytes_with_image_of(256) - bytes_with_image_of(1), kImageBytes - 4 * sizeof(float));
}

TEST(CompiledTextures, HaveALimitForAllTogether) {
  const auto image = [](ByteView, const std::string&) -> Result<Texels> {
    return Texels{256, 256, {}, std::vector<float>(256 * 256 * 4, 0.5f), false};
  };
  CompiledScene::Options options;
  options.max_texture_bytes = kImageBytes;
  EXPECT_TRUE(compile(load_text(two_textures("a.png"), {{"a.png", "a"}}), image, options).ok());
  const auto two = compile(load_text(two_textures("b.png"), {{"a.png", "a"}, {"b.png", "b"}}), image, options);
  ASSERT_FALSE(two.ok());
  EXPECT_EQ(message_of(two.status()), "textures[1] \"b\": the scene's images need more than the limit of 1 MiB");
}

}  // namespace
}  // namespace lightmill::test
