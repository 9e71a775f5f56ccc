#include "common/scene_io/gltf/gltf.h"

#include <cmath>
#include <numbers>

#include "common/scene/mesh.h"
#include "tests/unit/scene_io/gltf_fixture.h"

namespace lightmill {
namespace {

using test::error;
using test::expect_near;
using test::gltf;
using test::GltfBuffer;
using test::good;
using test::kOneNode;
using test::kPng;
using test::moved;
using test::OneTriangle;
using test::packed;
using test::read;

constexpr const char* kNoCamera =
    "there is no camera: one was added that sees all from the front, above and right (--camera chooses another)";
constexpr const char* kNoLight = "nothing emits light: a soft sky was added (--sky off leaves it out)";

TEST(GltfScene, NodesHaveTheTransformsOfTheirParents) {
  const float s = std::sqrt(0.5f);  // half a right angle's quaternion
  const LoadedScene loaded = good(OneTriangle().text(fmt::format(
      R"("scene":1,"scenes":[{{}},{{"nodes":[0,3]}}],"nodes":[
{{"name":"parent","translation":[10,0,0],"rotation":[0,0,{},{}],"children":[1,2]}},
{{"name":"child","mesh":0,"translation":[1,0,0],"scale":[2,3,4]}},
{{"mesh":0,"matrix":[0,1,0,0, -1,0,0,0, 0,0,1,0, 5,6,7,1]}},
{{"name":"root","mesh":0}},{{"name":"elsewhere","mesh":0}}])",
      s, s)));
  const auto& objects = loaded.scene.objects;
  ASSERT_EQ(objects.size(), 3u);
  // Parents come before their children, so roots come first.
  EXPECT_EQ(objects[0].name, "root");
  EXPECT_EQ(objects[0].transform, kIdentityTransform);
  // A quarter turn about z takes x to y.
  EXPECT_EQ(objects[1].name, "child");
  expect_near(moved(objects[1], {0, 0, 0}), {10, 1, 0}, 1e-6);
  expect_near(moved(objects[1], {1, 0, 0}), {10, 3, 0}, 1e-6);
  expect_near(moved(objects[1], {0, 1, 1}), {7, 1, 4}, 1e-6);
  EXPECT_EQ(objects[2].name, "tri");
  expect_near(moved(objects[2], {1, 0, 0}), {10 - 7, 5, 7}, 1e-6);
  // Instances share their mesh. The other asset is the sky.
  EXPECT_EQ(loaded.assets.size(), 2u);
}

TEST(GltfScene, NodeMistakesAreNamed) {
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"children":[1]},{"children":[0]}])"), "a.gltf: the scene has no triangles");
  EXPECT_EQ(error(R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"children":[1]},{"children":[0]}])"),
            "a.gltf: nodes[0]: the node is in the scene twice");
  EXPECT_EQ(error(R"("nodes":[{"mesh":1}])"), "a.gltf: nodes[0].mesh: an index into the 1 meshes is expected, got 1");
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"rotation":[0,0,0,0]}])"),
            "a.gltf: nodes[0].rotation: a unit quaternion is expected");
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"translation":[0,0]}])"),
            "a.gltf: nodes[0].translation: a list of 3 is expected, got a list of 2");
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"matrix":[1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}])"),
            "a.gltf: nodes[0].matrix: the matrix of an affine map is expected: its last row must be 0, 0, 0, 1");
  EXPECT_EQ(error(R"("scene":3,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}])"),
            "a.gltf: scene: an index into the 1 scenes is expected, got 3");
  EXPECT_EQ(error(R"("extensionsRequired":["KHR_texture_basisu"],"nodes":[{"mesh":0}])"),
            "a.gltf: extensionsRequired[0]: the file requires KHR_texture_basisu, which is not supported");
}

TEST(GltfScene, LightsHaveRadiometricUnits) {
  const LoadedScene loaded = good(OneTriangle().text(
      R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":683,"color":[1,0.5,0]},
{"type":"directional","intensity":1366},{"type":"spot","name":"beam","intensity":683,
"spot":{"innerConeAngle":0.3,"outerConeAngle":0.6}}]}},"nodes":[{"mesh":0},
{"name":"bulb","translation":[1,2,3],"extensions":{"KHR_lights_punctual":{"light":0}}},
{"rotation":[0.7071067811865476,0,0,0.7071067811865476],"extensions":{"KHR_lights_punctual":{"light":1}}},
{"extensions":{"KHR_lights_punctual":{"light":2}}}])"));
  ASSERT_EQ(loaded.scene.lights.size(), 3u);
  EXPECT_EQ(loaded.scene.lights[0].name, "bulb");
  const auto& point = std::get<PointLight>(loaded.scene.lights[0].kind);
  EXPECT_EQ(point.position, (Point3d{1, 2, 3}));
  EXPECT_EQ(point.intensity, (RgbColor{1, 0.5f, 0}));
  // −z, turned by a quarter about x, is +y.
  const auto& sun = std::get<DirectionalLight>(loaded.scene.lights[1].kind);
  expect_near(sun.direction, {0, 1, 0});
  EXPECT_EQ(sun.irradiance, (RgbColor{2, 2, 2}));
  const auto& spot = std::get<SpotLight>(loaded.scene.lights[2].kind);
  EXPECT_EQ(loaded.scene.lights[2].name, "beam");
  expect_near(spot.direction, {0, 0, -1});
  EXPECT_NEAR(spot.cutoff_degrees, 0.6 * 180 / std::numbers::pi, 1e-12);
  EXPECT_NEAR(spot.blend, 0.5, 1e-12);
  EXPECT_TRUE(loaded.notices.empty() || loaded.notices[0].find("cones") == std::string::npos);
  const LoadedScene wide = good(OneTriangle().text(
      R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"innerConeAngle":0.7,"outerConeAngle":0.6}}]}},
"nodes":[{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}}}])"));
  EXPECT_EQ(wide.notices.at(0),
            "left out: inner cones of spot lights that are wider than the outer ones: their edges are sharp");
  EXPECT_EQ(std::get<SpotLight>(wide.scene.lights.at(0).kind).blend, 0);
}

TEST(GltfScene, WrongValuesOfLightsAreIgnored) {
  const auto of = [](const std::string& light, const std::string& index, const std::string& fault) {
    const LoadedScene loaded = good(
        OneTriangle().text(fmt::format(R"("extensions":{{"KHR_lights_punctual":{{"lights":[{}]}}}},"nodes":[{{"mesh":0,
"extensions":{{"KHR_lights_punctual":{{"light":{}}}}}}}])",
                                       light, index)));
    EXPECT_EQ(loaded.faults.notices(), std::vector<std::string>{fault + ". It is ignored"});
    return loaded.scene.lights.at(0);
  };
  const std::string at = "a.gltf: extensions.KHR_lights_punctual.lights[0].";
  const Light dim = of(R"({"type":"point","intensity":-1,"color":[0.5,0,0]})", "0",
                       at + "intensity: a number from 0 to 1000000000000000 is expected, got -1");
  EXPECT_EQ(std::get<PointLight>(dim.kind).intensity, (RgbColor{static_cast<float>(0.5 / 683), 0, 0}));
  // Without its light the scene gets a sky.
  const Light sky = of(R"({"type":"laser"})", "0", at + "type: point, directional or spot is expected, got \"laser\"");
  EXPECT_TRUE(std::holds_alternative<EnvironmentLight>(sky.kind));
  of(R"({"type":"point"})", "7",
     "a.gltf: nodes[0].extensions.KHR_lights_punctual.light: an index into the 1 lights is expected, got 7");
}

TEST(GltfScene, CamerasLookAlongTheirNodes) {
  const LoadedScene loaded = good(OneTriangle().text(
      R"("cameras":[{"type":"perspective","name":"wide","perspective":{"yfov":1.5707963267948966,"aspectRatio":1.5}},
{"type":"orthographic"},{"type":"perspective","perspective":{"yfov":0.5}}],
"nodes":[{"mesh":0},{"camera":1},{"camera":0,"translation":[0,5,0],"rotation":[-0.7071067811865476,0,0,0.7071067811865476]},
{"name":"second","camera":2}])"));
  ASSERT_EQ(loaded.cameras.size(), 2u);
  EXPECT_EQ(loaded.cameras[0].name, "wide");
  EXPECT_EQ(loaded.cameras[1].name, "second");
  const Camera& camera = loaded.scene.camera;
  EXPECT_EQ(camera.eye, (Point3d{0, 5, 0}));
  EXPECT_LT(camera.look_at[1], 5);  // straight down
  EXPECT_NEAR(camera.look_at[0], 0, 1e-12);
  EXPECT_NEAR(camera.look_at[2], 0, 1e-12);
  expect_near(camera.up, {0, 0, -1});
  EXPECT_NEAR(camera.vertical_fov_degrees, 90, 1e-12);
  EXPECT_EQ(loaded.scene.film.width, 768);
  EXPECT_EQ(loaded.scene.film.height, 512);
  EXPECT_NE(std::find(loaded.notices.begin(), loaded.notices.end(), "left out: cameras that are not perspective"),
            loaded.notices.end());
}

TEST(GltfScene, TheDefaultCameraSeesTheWholeScene) {
  const LoadedScene loaded = good(OneTriangle().text(R"("nodes":[{"mesh":0,"scale":[100,10,1]}])"));
  const Camera& camera = loaded.scene.camera;
  const auto direction = [&](const Point3d& to) {
    Point3d d{to[0] - camera.eye[0], to[1] - camera.eye[1], to[2] - camera.eye[2]};
    const double length = std::hypot(d[0], d[1], d[2]);
    return Point3d{d[0] / length, d[1] / length, d[2] / length};
  };
  const Point3d ahead = direction(camera.look_at);
  for (const Point3d& corner : {Point3d{0, 0, 0}, Point3d{100, 0, 0}, Point3d{0, 10, 0}}) {
    const Point3d d = direction(corner);
    const double angle = std::acos(d[0] * ahead[0] + d[1] * ahead[1] + d[2] * ahead[2]) * 180 / std::numbers::pi;
    EXPECT_LE(angle, camera.vertical_fov_degrees / 2 + 1e-9);
  }
}

TEST(GltfScene, ASceneWithoutLightGetsASkyAndANotice) {
  const std::string text = OneTriangle().text(kOneNode);
  const LoadedScene lit = good(text);
  ASSERT_EQ(lit.scene.lights.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<EnvironmentLight>(lit.scene.lights[0].kind));
  EXPECT_EQ(lit.notices.back(), kNoLight);
  const Result<LoadedScene> dark = read(text, false);
  ASSERT_TRUE(dark.ok()) << dark.status();
  EXPECT_TRUE(dark->scene.lights.empty());
}

TEST(GltfScene, OmissionsAreReportedOnce) {
  const LoadedScene loaded = good(OneTriangle().text(
      R"("extensionsUsed":["KHR_materials_iridescence","KHR_materials_unlit"],"animations":[{}],
"materials":[{"alphaMode":"BLEND"},{"occlusionTexture":{"index":0}}],
"nodes":[{"mesh":0,"scale":[0,1,1]},{"mesh":0},{"mesh":0,"name":"flat","scale":[1,1e-40,1]}])",
      R"(,"material":0},{"attributes":{"POSITION":0},"material":1)"));
  EXPECT_EQ(loaded.notices,
            (std::vector<std::string>{"left out: extension KHR_materials_iridescence",
                                      "left out: animations (`--at SECONDS` shows a moment of one)",
                                      "left out: occlusion maps (light is followed instead)",
                                      "left out: objects with a scale of 0: nodes[0], nodes[2] \"flat\"", kNoCamera,
                                      kNoLight}));
  ASSERT_EQ(loaded.scene.objects.size(), 2u);
  EXPECT_EQ(loaded.scene.objects[0].name, "tri/materials[0]");
}

TEST(GltfScene, UnlistedExtensionsAreReported) {
  const LoadedScene loaded = good(OneTriangle().text(
      R"("extensions":{"EXT_scenery":{}},"extensionsUsed":["EXT_scenery"],"nodes":[{"mesh":0}],
"materials":[{"extensions":{"KHR_materials_iridescence":{},"KHR_materials_ior":{"ior":1.4},"KHR_materials_volume":{
"extensions":{"EXT_inner":{}}}},"extras":{"extensions":{"EXT_other":{}}}}])",
      R"(,"material":0)"));
  EXPECT_EQ(loaded.notices,
            (std::vector<std::string>{"left out: extension EXT_scenery", "left out: extension EXT_inner",
                                      "left out: extension KHR_materials_iridescence", kNoCamera, kNoLight}));
}

TEST(GltfScene, ObjectsMayBeThinAndLong) {
  const LoadedScene loaded =
      good(OneTriangle().text(R"("nodes":[{"mesh":0,"scale":[0.0005,0.0005,1000],"rotation":[0.6,0,0,0.8]}])"));
  ASSERT_EQ(loaded.scene.objects.size(), 1u);
  EXPECT_EQ(loaded.scene.objects[0].transform[0][0], 0.0005);
}

// Each primitive keeps only the vertices that its indices name, and the camera looks at these.
TEST(GltfScene, PrimitivesThatShareAccessorsKeepTheirOwnVertices) {
  constexpr int kPrimitives = 100, kSpare = 20'000;
  std::vector<float> positions, normals, coordinates;
  for (int i = 0; i < 3 * kPrimitives + kSpare; ++i) {
    const bool spare = i >= 3 * kPrimitives;
    const auto x = static_cast<float>(i);
    positions.insert(positions.end(), {spare ? 1e30f : x, spare ? 1e30f : static_cast<float>(i % 3 == 2), 0});
    normals.insert(normals.end(), {0, i % 2 == 0 ? 1.0f : -1.0f, 0});
    coordinates.insert(coordinates.end(), {x, 0});
  }
  GltfBuffer buffer;
  const auto count = positions.size() / 3;
  buffer.positions(positions);
  buffer.positions(normals);
  buffer.add(packed(coordinates), "VEC2", 5126, count);
  const int image = buffer.add(kPng, "SCALAR", 5121, kPng.size());
  std::string primitives;
  for (int i = 0; i < kPrimitives; ++i) {
    const auto first = static_cast<std::uint16_t>(3 * i);
    const int indices =
        buffer.indices({static_cast<std::uint16_t>(first + 2), first, static_cast<std::uint16_t>(first + 1)});
    primitives +=
        fmt::format(R"({}{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":{},"material":0}})",
                    i == 0 ? "" : ",", indices);
  }
  const LoadedScene loaded = good(gltf(fmt::format(
      R"({},"meshes":[{{"primitives":[{}]}}],"nodes":[{{"mesh":0}}],"images":[{{"bufferView":{}}}],
         "textures":[{{"source":0}}],
         "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}])",
      buffer.embedded(), primitives, image)));
  ASSERT_EQ(loaded.scene.objects.size(), std::size_t{kPrimitives});
  std::size_t bytes = 0;
  for (const auto& [digest, asset] : loaded.assets) {
    bytes += asset.size();
  }
  constexpr std::size_t kSky = 3'000;
  EXPECT_LT(bytes, kPrimitives * 200u + kSky);  // 3 vertices and a triangle are 160 bytes
  const auto& shape = std::get<MeshShape>(loaded.scene.objects[7].shape);
  const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(shape.asset)));
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->positions, (std::vector<Point3d>{{21, 0, 0}, {22, 0, 0}, {23, 1, 0}}));
  EXPECT_EQ(mesh->normals, (std::vector<std::array<float, 3>>{{0, -1, 0}, {0, 1, 0}, {0, -1, 0}}));
  EXPECT_EQ(mesh->texture_coordinates, (std::vector<std::array<float, 2>>{{21, 1}, {22, 1}, {23, 1}}));
  EXPECT_EQ(mesh->triangles, (std::vector<std::array<std::uint32_t, 3>>{{2, 0, 1}}));
  expect_near(loaded.scene.camera.look_at, {(3 * kPrimitives - 1) / 2.0, 0.5, 0});
}

// The named vertices are few and far apart, and some are in the accessor's sparse part.
TEST(GltfScene, SparseVerticesFarApartAreRead) {
  std::vector<float> positions(3 * 1000);
  positions[3 * 400] = 4;
  GltfBuffer buffer;
  const int replaced = buffer.indices({7, 999});
  const int values = buffer.positions({0, 5, 0, 0, 0, 9});
  buffer.add(packed(positions), "VEC3", 5126, 1000,
             fmt::format(R"(,"sparse":{{"count":2,"indices":{{"bufferView":{},"componentType":5123}},
                             "values":{{"bufferView":{}}}}})",
                         replaced, values));
  const int indices = buffer.indices({999, 0, 400});
  const LoadedScene loaded = good(gltf(fmt::format(
      R"({},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":2}},"indices":{}}}]}}],"nodes":[{{"mesh":0}}])",
      buffer.embedded(), indices)));
  const auto& shape = std::get<MeshShape>(loaded.scene.objects.at(0).shape);
  const Mesh mesh = *decode_mesh(as_byte_view(loaded.assets.at(shape.asset)));
  EXPECT_EQ(mesh.positions, (std::vector<Point3d>{{0, 0, 0}, {4, 0, 0}, {0, 0, 9}}));
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{2, 0, 1}}));
}

}  // namespace
}  // namespace lightmill
