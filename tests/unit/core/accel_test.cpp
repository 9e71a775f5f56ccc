// What Embree must never see: rays out of all numbers, and the geometry that makes them.
#include "common/scene/accel/accel.h"

#include <gtest/gtest.h>

#include "common/methods/method.h"

namespace lightmill {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Accel, RaysThatCannotBeTracedHitNothing) {
  for (const bool robust : {false, true}) {
    Accel accel(robust);
    accel.add_mesh(std::vector<std::array<float, 3>>{{-1, 0, -1}, {-1, 0, 9}, {9, 0, -1}},
                   std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}});
    accel.add_sphere(Vec3(0, -2, 0), 1);
    ASSERT_TRUE(accel.commit().ok());
    // From above, straight down; lanes 0 and 7 alone are proper rays.
    const std::array<float, 8> x{0, kNan, 0, kInfinity, 0, 1e30f, 0, 1};
    const std::array<float, 8> y{-1, -1, kNan, -1, -kInfinity, -1, -1, -1};
    const std::array<float, 8> far{9, 9, 9, 9, 9, 9, kNan, 9};
    const Ray8 rays{
        {F8::load(x.data()), F8(1.0f), F8(0.0f)}, {F8(0.0f), F8::load(y.data()), F8(0.0f)}, F8::load(far.data())};
    EXPECT_EQ(Accel::traceable(rays).bits(), 0b10000001);
    EXPECT_EQ(accel.intersect(M8(true), rays, false).hit.bits(), 0b10000001);
    EXPECT_EQ(accel.intersect(M8(true), rays, true).hit.bits(), 0b10000001);
    EXPECT_EQ(accel.occluded(M8(true), rays).bits(), 0b10000001);
  }
}

// The squared area of such triangles is zero in single precision, so they have no normal: glass refracts to nowhere.
// Samples that see them are counted as not finite, and the others are as they would be.
TEST(Accel, TrianglesWithoutANormalCostSamplesAndNothingElse) {
  Scene scene;
  std::map<Sha256, std::string> assets;
  const auto add = [&](std::uint32_t material, double size, double z) {
    Mesh mesh;
    mesh.positions = {{-size, -size, z}, {size, -size, z}, {size, size, z}, {-size, size, z}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    std::string bytes = encode_mesh(mesh);
    const Sha256 digest = sha256(bytes);
    assets.emplace(digest, std::move(bytes));
    scene.objects.push_back({"quad", material, MeshShape{"", digest}});
  };
  scene.materials = {{"lamp", DiffuseMaterial{{0, 0, 0}}, {1, 1, 1}, true},
                     {"glass", DielectricMaterial{1.5}, {}, false}};
  add(0, 1, 0);
  add(1, 1e-13, 1e-13);  // fills the middle of the picture
  scene.camera = {{0, 0, 5e-13}, {0, 0, 0}, {0, 1, 0}, 60};
  scene.film = {32, 32, {FilterKind::box, 0.5}};
  const auto compiled =
      CompiledScene::compile(scene, [&](const Sha256& digest) -> Result<std::string> { return assets.at(digest); });
  ASSERT_TRUE(compiled.ok());
  for (const char* name : {"path", "preview"}) {
    const auto method = make_method(*compiled, {name, 1, 0});
    const Node node = (*method)->render({0, 0, 32, 32}, {1, 0}, *(*method)->make_workspace());
    EXPECT_EQ(node.values[0], 1.0f) << name;  // a corner: the lamp
    EXPECT_EQ(node.non_finite > 0, std::string_view(name) == "path") << node.non_finite;
    EXPECT_TRUE(std::ranges::all_of(node.values, [](float v) { return std::isfinite(v); })) << name;
  }
}

}  // namespace
}  // namespace lightmill
