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

}  // namespace
}  // namespace lightmill::test
