#include "common/scene_io/gltf/gltf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/scene/mesh.h"
#include "common/wire/scene_proto.h"
#include "tests/unit/scene_io/gltf_text.h"

namespace lightmill {
namespace {

using test::gltf;
using test::GltfBuffer;
using test::packed;

Result<std::string> no_files(const std::string& name) {
  return not_found("cannot open {}", name);
}

const std::string kPng = "\x89PNG\r\n\x1a\n";  // as much of one as the reader looks at

/// A file with one triangle as meshes[0] and more members; the buffer's views and accessors go before.
class OneTriangle {
 public:
  OneTriangle() {
    buffer_.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    buffer_.add(packed<float>({0, 0, 1, 0, 0, 1}), "VEC2", 5126, 3);
    buffer_.add(kPng, "SCALAR", 5121, kPng.size());
  }
  std::string text(const std::string& members, const std::string& primitive = "") const {
    return gltf(fmt::format(
        R"({},"meshes":[{{"name":"tri","primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}}{}}}]}}],{})",
        buffer_.embedded(), primitive, members));
  }

 private:
  GltfBuffer buffer_;
};

Result<LoadedScene> read(const std::string& text, bool light_the_dark = true) {
  return read_gltf(text, "a.gltf", light_the_dark, no_files);
}

LoadedScene good(const std::string& text) {
  Result<LoadedScene> loaded = read(text);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  const Result<Scene> back = unpack_scene(pack_scene(loaded->scene));
  EXPECT_TRUE(back.ok()) << back.status();
  return *std::move(loaded);
}

std::string error(const std::string& members, const std::string& primitive = "") {
  const Result<LoadedScene> loaded = read(OneTriangle().text(members, primitive));
  return loaded.ok() ? "no error" : message_of(loaded.status());
}

const std::string kOneNode = R"("nodes":[{"mesh":0}])";

/// A file whose only material has these members, without a sky.
Material material(const std::string& members, std::vector<std::string>* notices = nullptr) {
  const Result<LoadedScene> loaded =
      read(OneTriangle().text(kOneNode + fmt::format(R"(,"materials":[{{{}}}])", members), R"(,"material":0)"), false);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  if (notices != nullptr) {
    *notices = loaded->notices;
  }
  return loaded->scene.materials.at(0);
}

void expect_near(const Point3d& a, const Point3d& b, double tolerance = 1e-12) {
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a[i], b[i], tolerance);
  }
}

Point3d moved(const Object& object, const Point3d& p) {
  Point3d out;
  for (std::size_t row = 0; row < 3; ++row) {
    const auto& t = object.transform[row];
    out[row] = t[0] * p[0] + t[1] * p[1] + t[2] * p[2] + t[3];
  }
  return out;
}

TEST(GltfScene, NodesStandWhereTheirParentsPutThem) {
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
  // Parents come first, so the roots do.
  EXPECT_EQ(objects[0].name, "root");
  EXPECT_EQ(objects[0].transform, kIdentityTransform);
  // A quarter turn about z takes x to y.
  EXPECT_EQ(objects[1].name, "child");
  expect_near(moved(objects[1], {0, 0, 0}), {10, 1, 0}, 1e-6);
  expect_near(moved(objects[1], {1, 0, 0}), {10, 3, 0}, 1e-6);
  expect_near(moved(objects[1], {0, 1, 1}), {7, 1, 4}, 1e-6);
  EXPECT_EQ(objects[2].name, "tri");
  expect_near(moved(objects[2], {1, 0, 0}), {10 - 7, 5, 7}, 1e-6);
  // Instances share their mesh.
  EXPECT_EQ(loaded.assets.size(), 1u);
}

TEST(GltfScene, NodeMistakesAreNamed) {
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"children":[1]},{"children":[0]}])"), "a.gltf: the scene has no triangles");
  EXPECT_EQ(error(R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"children":[1]},{"children":[0]}])"),
            "a.gltf: nodes[0]: the node stands in the scene twice");
  EXPECT_EQ(error(R"("nodes":[{"mesh":1}])"), "a.gltf: nodes[0].mesh: an index into the 1 meshes is expected, got 1");
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"rotation":[0,0,0,0]}])"),
            "a.gltf: nodes[0].rotation: a unit quaternion is expected");
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"translation":[0,0]}])"),
            "a.gltf: nodes[0].translation: a list of 3 is expected, got a list of 2");
  EXPECT_EQ(error(R"("nodes":[{"mesh":0,"matrix":[1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}])"),
            "a.gltf: nodes[0].matrix: the matrix of an affine map is expected: its last row must be 0, 0, 0, 1");
  EXPECT_EQ(error(R"("scene":3,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}])"),
            "a.gltf: scene: an index into the 1 scenes is expected, got 3");
  EXPECT_EQ(error(R"("extensionsRequired":["KHR_draco_mesh_compression"],"nodes":[{"mesh":0}])"),
            "a.gltf: extensionsRequired[0]: KHR_draco_mesh_compression is not supported, and the file cannot be read "
            "without");
}

TEST(GltfScene, MetallicRoughnessIsPrincipled) {
  std::vector<std::string> notices;
  const Material gold = material(
      R"("name":"gold","pbrMetallicRoughness":{"baseColorFactor":[1,0.75,0.25,1],"metallicFactor":0.5,
"roughnessFactor":0.25},"emissiveFactor":[0.5,0,0],"doubleSided":true,"extensions":{
"KHR_materials_emissive_strength":{"emissiveStrength":8},"KHR_materials_ior":{"ior":1.25},
"KHR_materials_clearcoat":{"clearcoatFactor":0.75,"clearcoatRoughnessFactor":0.125},
"KHR_materials_specular":{"specularFactor":0.5}})",
      &notices);
  EXPECT_EQ(gold.name, "gold");
  const auto& p = std::get<PrincipledMaterial>(gold.kind);
  EXPECT_EQ(p.base_color.rgb, (RgbColor{1, 0.75f, 0.25f}));
  EXPECT_EQ(p.base_color.texture, kNoTexture);
  EXPECT_EQ(p.metallic, 0.5);
  EXPECT_EQ(p.roughness, 0.25);
  EXPECT_EQ(p.specular, 0.25);
  EXPECT_EQ(p.transmission, 0);
  EXPECT_EQ(p.ior, 1.25);
  EXPECT_EQ(p.coat, 0.75);
  EXPECT_EQ(p.coat_roughness, 0.125);
  EXPECT_EQ(gold.emission.rgb, (RgbColor{4, 0, 0}));
  EXPECT_TRUE(gold.two_sided_emission);
  EXPECT_EQ(notices, std::vector<std::string>{
                         "the file has no camera: all of it is seen from the front, from above and from the right"});
  const Material matt =
      material(R"("extensions":{"KHR_materials_specular":{"specularColorFactor":[0,0,0]}})", &notices);
  EXPECT_EQ(std::get<PrincipledMaterial>(matt.kind).specular, 0);
  EXPECT_EQ(notices.size(), 1u);
  const Material tinted =
      material(R"("extensions":{"KHR_materials_specular":{"specularColorFactor":[2,1,0]}})", &notices);
  EXPECT_EQ(std::get<PrincipledMaterial>(tinted.kind).specular, 0.5);
  EXPECT_EQ(notices[0], "coloured highlights of plastic are rendered in white, as bright on the mean");
  // What the format says of a material that says nothing.
  const Material plain = material("");
  const auto& d = std::get<PrincipledMaterial>(plain.kind);
  EXPECT_EQ(d.base_color.rgb, (RgbColor{1, 1, 1}));
  EXPECT_EQ(d.metallic, 1);
  EXPECT_EQ(d.roughness, 1);
  EXPECT_EQ(d.specular, 0.5);
  EXPECT_EQ(d.ior, 1.5);
  EXPECT_EQ(d.coat, 0);
  EXPECT_EQ(plain.emission.rgb, RgbColor{});
}

// KHR_materials_ior: with 0 all light is reflected, but for what KHR_materials_specular's factors leave of it; so
// materials of specular and glossiness are written.
TEST(GltfScene, AnIndexOfZeroReflectsWhatTheFactorsSay) {
  // The principled material's reflectances at normal incidence and at grazing angles.
  const auto reflectances = [](const std::string& specular, std::vector<std::string>* notices = nullptr) {
    const Material made = material(
        R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":0})" + specular + "}",
        notices);
    const auto& p = std::get<PrincipledMaterial>(made.kind);
    EXPECT_LE(p.ior, kMaxIor);
    EXPECT_LE(p.specular, 1);
    const double f0 = std::pow((p.ior - 1) / (p.ior + 1), 2) * 2 * p.specular;
    return std::pair(f0, std::min({2 * p.specular, 50 * f0, 1.0}));
  };
  const auto expect = [](std::pair<double, double> got, double f0, double f90) {
    EXPECT_NEAR(got.first, f0, 1e-9);
    EXPECT_NEAR(got.second, f90, 1e-9);
  };
  expect(reflectances(""), 1, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[0.25,0.25,0.25]})"), 0.25, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[0.9,0.9,0.9]})"), 0.9, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[0.25,0.25,0.25]})"),
         0.125, 0.5);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[0,0,0]})"), 0, 0);
  std::vector<std::string> notices;
  reflectances(R"(,"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_volume":{"thicknessFactor":1})",
               &notices);
  EXPECT_EQ(notices[0], "left out: an index of refraction of 0 where light is transmitted: it is 1.5");
}

TEST(GltfScene, TexturesThatAnExtensionAloneBringsAreLeftOut) {
  const auto of = [](const std::string& texture, std::vector<std::string>& notices) {
    const Result<LoadedScene> loaded =
        read(OneTriangle().text(kOneNode + fmt::format(R"(,"images":[{{"bufferView":2}}],"textures":[{}],"materials":[
{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.5,0.5,1],"baseColorTexture":{{"index":0}}}}}}])",
                                                       texture),
                                R"(,"material":0)"),
             false);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    notices = loaded.ok() ? loaded->notices : std::vector<std::string>{};
    return loaded.ok() ? std::get<PrincipledMaterial>(loaded->scene.materials.at(0).kind).base_color : TexturedColor{};
  };
  std::vector<std::string> notices;
  EXPECT_EQ(of(R"({"extensions":{"EXT_texture_webp":{"source":0}}})", notices),
            (TexturedColor{{0.5f, 0.5f, 0.5f}, kNoTexture}));
  EXPECT_EQ(notices[0], "left out: textures whose only image is of EXT_texture_webp");
  of(R"({"extensions":{"KHR_texture_basisu":{"source":0}}})", notices);
  EXPECT_EQ(notices[0], "left out: textures whose only image is of KHR_texture_basisu");
  of(R"({"extensions":{"NOBODY_texture":{}}})", notices);
  EXPECT_EQ(notices[0], "left out: textures whose only image is of extensions that are not known");
  // Where there is an image for those who do not know the extension, it is taken.
  EXPECT_EQ(of(R"({"source":0,"extensions":{"EXT_texture_webp":{"source":7}}})", notices).texture, 0u);
  EXPECT_EQ(notices.size(), 1u);  // of the camera
}

TEST(GltfScene, VolumesAbsorb) {
  const Material amber = material(
      R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_transmission":{"transmissionFactor":1},
"KHR_materials_volume":
{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[1,0.5,0]}})");
  EXPECT_EQ(std::get<PrincipledMaterial>(amber.kind).transmission, 1);
  EXPECT_EQ(amber.interior.absorption.r, 0);
  EXPECT_NEAR(amber.interior.absorption.g, std::numbers::ln2 / 2, 1e-6);  // half of it is left after 2
  EXPECT_GT(amber.interior.absorption.b, 1e20f);
  std::vector<std::string> notices;
  const std::string half = R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":0.5}})";
  material(R"("pbrMetallicRoughness":{"metallicFactor":0},)" + half, &notices);
  EXPECT_EQ(notices[0], "materials that transmit without a volume are rendered as solid glass: light is refracted");
  material(half, &notices);  // a metal: nothing gets in
  EXPECT_EQ(notices.size(), 1u);
}

TEST(GltfScene, UnlitMaterialsEmit) {
  const Material unlit =
      material(R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,1,0,1]},"extensions":{"KHR_materials_unlit":{}})");
  EXPECT_EQ(unlit.emission.rgb, (RgbColor{0.5f, 1, 0}));
  EXPECT_TRUE(unlit.two_sided_emission);
  EXPECT_EQ(std::get<DiffuseMaterial>(unlit.kind).reflectance.rgb, RgbColor{});
}

TEST(GltfScene, TexturesAreKeptAsTheyAre) {
  const LoadedScene loaded = good(OneTriangle().text(
      kOneNode +
          R"(,"images":[{"bufferView":2,"name":"wood"}],"samplers":[{"magFilter":9728,"wrapS":33071,"wrapT":33071}],
"textures":[{"source":0,"sampler":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,
"extensions":{"KHR_texture_transform":{"scale":[2,3],"offset":[0.25,0.5]}}},"metallicRoughnessTexture":{"index":0}},"emissiveFactor":[1,1,1],
"emissiveTexture":{"index":0}}])",
      R"(,"material":0)"));
  ASSERT_EQ(loaded.scene.textures.size(), 3u);
  const TextureImage& base = loaded.scene.textures[1];
  EXPECT_EQ(base.file, "wood.png");
  EXPECT_EQ(loaded.assets.at(base.asset), kPng);
  ASSERT_EQ(loaded.images.size(), 1u);
  EXPECT_EQ(loaded.images[0].asset, base.asset);
  EXPECT_EQ(loaded.images[0].place, "a.gltf: images[0]");
  EXPECT_EQ(base.filter, TextureImage::Filter::nearest);
  EXPECT_EQ(base.wrap, TextureImage::Wrap::clamp);
  EXPECT_EQ(base.color_space, TextureImage::ColorSpace::srgb);
  // Theirs: v' = 3v + 0.5, counted downwards. Ours is 1 − v: at their v = 0.25 it is 0.75 before and −0.25 after.
  EXPECT_EQ(base.scale, (std::array<double, 2>{2, 3}));
  EXPECT_DOUBLE_EQ(base.scale[1] * 0.75 + base.offset[1], 1 - (3 * 0.25 + 0.5));
  EXPECT_DOUBLE_EQ(base.offset[0], 0.25);
  const TextureImage& emission = loaded.scene.textures[0];
  EXPECT_EQ(emission.scale, (std::array<double, 2>{1, 1}));
  EXPECT_EQ(emission.offset, (std::array<double, 2>{0, 0}));
  EXPECT_NE(base.name, emission.name);
  EXPECT_EQ(loaded.scene.materials[0].emission.texture, 0u);
  EXPECT_EQ(std::get<PrincipledMaterial>(loaded.scene.materials[0].kind).base_color.texture, 1u);
  EXPECT_EQ(loaded.scene.materials[0].roughness_map, (ScalarMap{2, ScalarMap::Channel::g}));
  EXPECT_EQ(loaded.scene.materials[0].metallic_map, (ScalarMap{2, ScalarMap::Channel::b}));
  EXPECT_EQ(loaded.scene.textures[2].color_space, TextureImage::ColorSpace::linear);
  const auto& shape = std::get<MeshShape>(loaded.scene.objects[0].shape);
  const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(shape.asset)));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->texture_coordinates, (std::vector<std::array<float, 2>>{{0, 1}, {1, 1}, {0, 0}}));
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
  EXPECT_EQ(error(R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"laser"}]}},"nodes":[{"mesh":0,
"extensions":{"KHR_lights_punctual":{"light":0}}}])"),
            "a.gltf: extensions.KHR_lights_punctual.lights[0].type: point, directional or spot is expected, got "
            "\"laser\"");
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

TEST(GltfScene, WithoutACameraAllIsSeen) {
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

TEST(GltfScene, TheDarkIsLitAndSaid) {
  const std::string text = OneTriangle().text(kOneNode);
  const LoadedScene lit = good(text);
  ASSERT_EQ(lit.scene.lights.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<EnvironmentLight>(lit.scene.lights[0].kind));
  EXPECT_EQ(lit.notices.back(), "nothing in the file emits light: it stands in an even white sky");
  const Result<LoadedScene> dark = read(text, false);
  ASSERT_TRUE(dark.ok()) << dark.status();
  EXPECT_TRUE(dark->scene.lights.empty());
}

TEST(GltfScene, WhatIsLeftOutIsSaidOnce) {
  const LoadedScene loaded = good(OneTriangle().text(
      R"("extensionsUsed":["KHR_materials_sheen","KHR_materials_unlit"],"animations":[{}],
"materials":[{"normalTexture":{"index":0},"alphaMode":"BLEND"},{"normalTexture":{"index":0},"occlusionTexture":{"index":0}}],
"nodes":[{"mesh":0,"scale":[0,1,1]},{"mesh":0,"skin":0},{"mesh":0,"name":"flat","scale":[1,1e-40,1]}])",
      R"(,"material":0},{"attributes":{"POSITION":0},"material":1)"));
  EXPECT_EQ(loaded.notices,
            (std::vector<std::string>{
                "left out: extension KHR_materials_sheen", "left out: normal maps",
                "left out: alpha: what is transparent by it is rendered opaque",
                "left out: occlusion maps (light is followed instead)",
                "left out: skins (meshes stand as they were modelled)",
                "left out: objects that are scaled to nothing: nodes[0], nodes[2] \"flat\"", "left out: animations",
                "the file has no camera: all of it is seen from the front, from above and from the right",
                "nothing in the file emits light: it stands in an even white sky"}));
  ASSERT_EQ(loaded.scene.objects.size(), 2u);
  EXPECT_EQ(loaded.scene.objects[0].name, "tri/materials[0]");
}

TEST(GltfScene, ExtensionsThatAreUsedAndNotListedAreSaidToo) {
  const LoadedScene loaded = good(OneTriangle().text(
      R"("extensions":{"EXT_scenery":{}},"extensionsUsed":["EXT_scenery"],"nodes":[{"mesh":0}],
"materials":[{"extensions":{"KHR_materials_sheen":{},"KHR_materials_ior":{"ior":1.4},"KHR_materials_volume":{
"extensions":{"EXT_inner":{}}}},"extras":{"extensions":{"EXT_nobody":{}}}}])",
      R"(,"material":0)"));
  EXPECT_EQ(loaded.notices,
            (std::vector<std::string>{"left out: extension EXT_scenery", "left out: extension EXT_inner",
                                      "left out: extension KHR_materials_sheen",
                                      "the file has no camera: all of it is seen from the front, from above and from "
                                      "the right",
                                      "nothing in the file emits light: it stands in an even white sky"}));
}

TEST(GltfScene, MaterialMistakesAreNamed) {
  const auto of = [](const std::string& members) {
    return error(kOneNode + fmt::format(R"(,"materials":[{{{}}}])", members), R"(,"material":0)");
  };
  EXPECT_EQ(of(R"("pbrMetallicRoughness":{"metallicFactor":2})"),
            "a.gltf: materials[0].pbrMetallicRoughness.metallicFactor: a number from 0 to 1 is expected, got 2");
  EXPECT_EQ(of(R"("emissiveFactor":[1,1])"),
            "a.gltf: materials[0].emissiveFactor: a list of 3 is expected, got a list of 2");
  EXPECT_EQ(
      of(R"("pbrMetallicRoughness":{"baseColorTexture":{"index":0}})"),
      "a.gltf: materials[0].pbrMetallicRoughness.baseColorTexture.index: an index into the 0 textures is expected, "
      "got 0");
  EXPECT_EQ(error(kOneNode + R"(,"images":[{"bufferView":0}],"textures":[{"source":0}],
"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
                  R"(,"material":0)"),
            "a.gltf: images[0]: PNG or JPEG is expected");
  EXPECT_EQ(
      error(kOneNode + R"(,"textures":[{}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
            R"(,"material":0)"),
      "a.gltf: textures[0].source: an image is expected");
}

// A scale along one axis says nothing of the others.
TEST(GltfScene, ObjectsMayBeThinAndLong) {
  const LoadedScene loaded =
      good(OneTriangle().text(R"("nodes":[{"mesh":0,"scale":[0.0005,0.0005,1000],"rotation":[0.6,0,0,0.8]}])"));
  ASSERT_EQ(loaded.scene.objects.size(), 1u);
  EXPECT_EQ(loaded.scene.objects[0].transform[0][0], 0.0005);
}

// Each primitive keeps the vertices that its indices name, and no others; the camera looks at what is there.
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
  EXPECT_LT(bytes, kPrimitives * 200u);  // 3 vertices and a triangle are 160 bytes
  const auto& shape = std::get<MeshShape>(loaded.scene.objects[7].shape);
  const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(shape.asset)));
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->positions, (std::vector<Point3d>{{21, 0, 0}, {22, 0, 0}, {23, 1, 0}}));
  EXPECT_EQ(mesh->normals, (std::vector<std::array<float, 3>>{{0, -1, 0}, {0, 1, 0}, {0, -1, 0}}));
  EXPECT_EQ(mesh->texture_coordinates, (std::vector<std::array<float, 2>>{{21, 1}, {22, 1}, {23, 1}}));
  EXPECT_EQ(mesh->triangles, (std::vector<std::array<std::uint32_t, 3>>{{2, 0, 1}}));
  expect_near(loaded.scene.camera.look_at, {(3 * kPrimitives - 1) / 2.0, 0.5, 0});
}

// Also where the named vertices are few and far apart, and some stand in the accessor's sparse part.
TEST(GltfScene, VerticesThatAreFarApartAndSparse) {
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
