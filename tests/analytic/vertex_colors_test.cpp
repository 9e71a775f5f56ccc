// Colours of vertices: interpolated over triangles, they multiply the reflectance, and their alpha the opacity.
#include <gtest/gtest.h>

#include "common/base/file.h"
#include "tests/analytic/scene_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/scene_io/gltf_text.h"

namespace lightmill::test {
namespace {

/// Red at (0, 0), green at (1, 0) and blue at (0, 1), in the plane z = 0. Colours of 0 and 1 are the same encoded.
const std::string kTriangle = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n";

std::string looking_at(double x, double y) {
  return fmt::format(R"("eye": [{0}, {1}, 3], "look_at": [{0}, {1}, 0])", x, y);
}

void expect_color(const HalfImages& image, std::array<double, 3> exact, const std::string& what) {
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(mean_of(image, channel).value, exact[static_cast<std::size_t>(channel)], 1e-4) << what;
  }
}

TEST(VertexColors, AreInterpolatedAndMultiplyTheReflectance) {
  const std::array<std::string, 4> materials{
      R"("diffuse": {"reflectance": {"rgb": [1, 0.5, 0.25]}})", R"("mirror": {"reflectance": {"rgb": [1, 0.5, 0.25]}})",
      R"("phong": {"diffuse": {"rgb": [1, 0.5, 0.25]}})", R"("principled": {"base_color": {"rgb": [1, 0.5, 0.25]}})"};
  for (const std::string& kind : materials) {
    for (const auto& [x, y] : {std::pair{1.0 / 3, 1.0 / 3}, {0.5, 0.25}, {0.125, 0.75}}) {
      const auto scene = TestScene::from_text(
          document(looking_at(x, y), 1e-3, 1, named("paint", kind), mesh("paint", "t.obj")), {{"t.obj", kTriangle}});
      expect_color(scene.render({"preview", 1, 0}, 1), {1 - x - y, 0.5 * x, 0.25 * y}, kind);
    }
  }
  // Glass has no reflectance of its own.
  const auto glass = TestScene::from_text(
      document(looking_at(0.25, 0.25), 1e-3, 1, named("glass", R"("dielectric": {})"), mesh("glass", "t.obj")),
      {{"t.obj", kTriangle}});
  expect_color(glass.render({"preview", 1, 0}, 1), {1, 1, 1}, "glass");
}

// L = ρ I cos / (π d²), below a light at distance 2 and on its axis.
TEST(VertexColors, AreLitLikeAnyReflectance) {
  const auto scene =
      TestScene::from_text(document(looking_at(0.25, 0.25), 1e-3, 4, diffuse("paint", 0.5), mesh("paint", "t.obj"),
                                    R"({"point": {"position": [0.25, 0.25, 2], "intensity": {"rgb": [4, 4, 4]}}})"),
                           {{"t.obj", kTriangle}});
  for (const std::string method : {"path", "raycast", "whitted"}) {
    expect_color(scene.render({method, 1, 1}, 1), {0.25 / M_PI, 0.125 / M_PI, 0.125 / M_PI}, method);
  }
}

// Meshes of at least 64 triangles with several users are instances, which share their rows.
TEST(VertexColors, InstancesHaveThem) {
  std::string grid;
  for (int i = 0; i < 81; ++i) {
    grid += fmt::format("v {} {} 0 {} 0 1\n", i % 9, i / 9, i % 9 < 4 ? 0 : 1);
  }
  for (int i = 0; i < 72; ++i) {
    if (i % 9 != 8) {
      grid += fmt::format("f {} {} {} {}\n", i + 1, i + 2, i + 11, i + 10);
    }
  }
  const std::string file = R"("mesh": {"file": "grid.obj"})";
  const auto scene = [&](double x, double y) {
    return TestScene::from_text(
        document(looking_at(x, y), 1e-3, 1, diffuse("paint", 1),
                 shape("paint", file) + also(shape("paint", file, R"({"scale": [2, 2, 2], "translate": [20, 0, 0]})"))),
        {{"grid.obj", grid}});
  };
  expect_color(scene(1.3, 2.2).render({"preview", 1, 0}, 1), {0, 0, 1}, "left");
  expect_color(scene(6.3, 2.2).render({"preview", 1, 0}, 1), {1, 0, 1}, "right");
  expect_color(scene(20 + 2 * 3.25, 4.4).render({"preview", 1, 0}, 1), {0.25, 0, 1}, "between, and moved");
}

/// A glTF file with a white emitter at z = −1, and before it a black square whose alpha is 0 on the left and 1 on the
/// right.
std::string fading_square(const std::string& mode) {
  GltfBuffer b;
  b.positions({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0});
  b.positions({-5, -5, -1, 5, -5, -1, 5, 5, -1, -5, 5, -1});
  b.indices({0, 1, 2, 0, 2, 3});
  b.add(packed<std::uint8_t>({255, 255, 255, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0}), "VEC4",
        5121, 4, R"(,"normalized":true)");
  return gltf(b.embedded() +
              R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":3},"indices":2,"material":0}]},
{"primitives":[{"attributes":{"POSITION":1},"indices":2,"material":1}]}],"nodes":[{"mesh":0},{"mesh":1},
{"camera":0,"translation":[0,0,3]}],"cameras":[{"type":"perspective","perspective":{"yfov":0.4,"aspectRatio":1}}],
"materials":[{"alphaMode":")" +
              mode + R"(","pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1],"metallicFactor":0},
"extensions":{"KHR_materials_specular":{"specularFactor":0}}},{"extensions":{"KHR_materials_unlit":{}}}])");
}

// The square covers the view of ±0.6. Alpha is (x + 1)/2, so its mean there is 1/2. Above the cutoff 1/2 is the right half.
TEST(VertexColors, AlphaMultipliesTheOpacity) {
  const TemporaryFolder folder;
  const auto scene = [&](const std::string& mode) {
    const std::filesystem::path path = folder.path() / "a.gltf";
    EXPECT_TRUE(write_file_atomically(path, as_byte_view(fading_square(mode))).ok());
    return TestScene(path).resized(16, 16);
  };
  const HalfImages blended = scene("BLEND").render({"path", 1, 0}, 8);
  expect_answer(mean_of(blended, 0), 0.5, 1e-2);
  const HalfImages masked = scene("MASK").render({"path", 1, 0}, 4), opaque = scene("OPAQUE").render({"path", 1, 0}, 4);
  for (std::size_t y = 0; y < 16; ++y) {
    EXPECT_LT(blended.mean(3 * (16 * y + 14)), blended.mean(3 * (16 * y + 1)));
    for (const auto& [x, light] : {std::pair{1, 1.0}, {5, 1.0}, {10, 0.0}, {14, 0.0}}) {
      EXPECT_EQ(masked.mean(3 * (16 * y + static_cast<std::size_t>(x))), light) << x;
      EXPECT_EQ(opaque.mean(3 * (16 * y + static_cast<std::size_t>(x))), 0) << x;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
