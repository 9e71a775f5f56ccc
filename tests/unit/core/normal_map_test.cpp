// Shading normals by normal maps and bump maps, at points of compiled scenes.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include <fmt/format.h>

#include "common/image/png.h"
#include "common/scene/compiled/transform.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/scene_io/gltf_text.h"

namespace lightmill::test {
namespace {

using Transforms = std::vector<Transform>;

/// A mesh over [0, 1]² in the plane z = 0, of n² squares, with texture coordinates (x, y).
Mesh card(std::uint32_t n = 1) {
  Mesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      const double u = x / static_cast<double>(n), v = y / static_cast<double>(n);
      mesh.positions.push_back({u, v, 0});
      mesh.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
  }
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t corner = y * (n + 1) + x;
      mesh.triangles.push_back({corner, corner + 1, corner + n + 2});
      mesh.triangles.push_back({corner, corner + n + 2, corner + n + 1});
    }
  }
  return mesh;
}

Mesh card_with(const std::function<std::array<float, 2>(float, float)>& coordinates) {
  Mesh mesh = card();
  for (auto& [u, v] : mesh.texture_coordinates) {
    const auto [a, b] = coordinates(u, v);
    u = a;
    v = b;
  }
  return mesh;
}

/// An image of floats whose colours are a function of the texel's middle in (0, 1)², v upwards.
Texels image_of(int width, int height, const std::function<Vec3d(double, double)>& color) {
  std::vector<float> values;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec3 c(color((x + 0.5) / width, 1 - (y + 0.5) / height));
      values.insert(values.end(), {c.x, c.y, c.z, 1.0f});
    }
  }
  return {width, height, {}, std::move(values), false};
}

/// The texel of a unit normal.
Vec3d texel_of(const Vec3d& n) {
  return (glm::normalize(n) + 1.0) * 0.5;
}

/// Objects of one mesh and one material with a normal map or bump map.
struct MappedCard {
  Mesh mesh = card();
  Texels texels = image_of(1, 1, [](double, double) { return texel_of({0.3, 0.1, 1}); });
  TextureImage image{"map", "map.exr", sha256("map")};
  std::optional<BumpMap> bump = {};  ///< else a normal map
  double scale = 1;
  Transforms transforms{kIdentityTransform};
  std::optional<PlaneShape> plane = {};

  std::shared_ptr<const CompiledScene> compiled() const {
    Scene scene;
    scene.camera = {{0, 0, 20}, {0, 0, 0}};
    scene.textures = {image};
    Material material;
    material.name = "m";
    if (bump) {
      material.bump_map = *bump;
    } else {
      material.normal_map = {0, scale};
    }
    scene.materials = {material};
    const std::string bytes = encode_mesh(mesh);
    for (const Transform& transform : transforms) {
      scene.objects.push_back({"card", 0, MeshShape{"", sha256(bytes)}, transform});
    }
    if (plane) {
      scene.objects = {{"plane", 0, *plane}};
    }
    const auto assets = [&](const Sha256& digest) -> Result<std::string> {
      return digest == image.asset ? std::string("map") : bytes;
    };
    auto out =
        CompiledScene::compile(scene, assets, [&](ByteView, const std::string&) -> Result<Texels> { return texels; });
    EXPECT_TRUE(out.ok()) << message_of(out.status());
    return *out;
  }

  /// The shading normal where a ray hits.
  static Vec3d normal_at(const CompiledScene& scene, const Vec3d& from, const Vec3d& direction) {
    const Ray8 ray{broadcast(Vec3(scene.frame().to_frame(from))), broadcast(Vec3(glm::normalize(direction))),
                   F8(std::numeric_limits<float>::infinity())};
    const Hit8 hit = scene.accel().intersect(first_lanes(1), ray, false);
    EXPECT_EQ(hit.hit.bits(), 1) << "the ray hits nothing";
    return Vec3d(VectorLanes(scene.surface(ray, hit).shading_normal)[0]);
  }
  /// At the point (x, y) of the first object, in its own coordinates.
  Vec3d normal(double x = 0.3, double y = 0.6) const {
    const Affine map(transforms[0]);
    const Vec3d to = map(Vec3d(x, y, 0)),
                off = map.linear * Vec3d(0.02, 0.01, 0) + glm::normalize(map.normal_matrix() * Vec3d(0, 0, 1));
    return normal_at(*compiled(), to + off, -off);
  }
};

void expect_direction(const Vec3d& got, const Vec3d& expected, double tolerance = 1e-6) {
  EXPECT_LT(glm::length(got - glm::normalize(expected)), tolerance) << fmt::format("({}, {}, {})", got.x, got.y, got.z);
}

Transform linear(const Vec3d& x, const Vec3d& y, const Vec3d& z, const Vec3d& move = Vec3d(0)) {
  return {{{x.x, y.x, z.x, move.x}, {x.y, y.y, z.y, move.y}, {x.z, y.z, z.z, move.z}}};
}

TEST(NormalMap, AFlatMapKeepsTheNormal) {
  MappedCard mapped;
  mapped.texels = image_of(1, 1, [](double, double) { return Vec3d(0.5, 0.5, 1); });
  EXPECT_EQ(mapped.normal(), Vec3d(0, 0, 1));
  // With 8 bits, 128 is the nearest to a half.
  mapped.texels = Texels{1, 1, std::vector<std::uint32_t>{0xffff8080u}, {}, true};
  expect_direction(mapped.normal(), {1 / 255.0, 1 / 255.0, 1});
}

TEST(NormalMap, RedIsAlongUAndGreenAlongV) {
  expect_direction(MappedCard().normal(), {0.3, 0.1, 1});
  MappedCard strong;
  strong.scale = 2;
  expect_direction(strong.normal(), {0.6, 0.2, 1});
  MappedCard turned;  // u along y, v against x
  turned.mesh = card_with([](float x, float y) { return std::array{y, -x}; });
  expect_direction(turned.normal(), {-0.1, 0.3, 1});
}

TEST(NormalMap, MirroredTextureCoordinatesMirrorTheFrame) {
  MappedCard against_x, against_y, by_image;
  against_x.mesh = card_with([](float x, float y) { return std::array{-x, y}; });
  expect_direction(against_x.normal(), {-0.3, 0.1, 1});
  against_y.mesh = card_with([](float x, float y) { return std::array{x, 5 - 3 * y}; });
  expect_direction(against_y.normal(), {0.3, -0.1, 1});
  by_image.image.scale = {-2, 0.5};
  expect_direction(by_image.normal(), {-0.3, 0.1, 1});
}

TEST(NormalMap, RotatedTextureCoordinatesRotateTheFrame) {
  MappedCard turned;  // the image's first coordinate grows against y, and its second one along x
  turned.image.rotation_degrees = 90;
  expect_direction(turned.normal(), {0.1, -0.3, 1});
  turned.image.scale = {-1, 1};
  expect_direction(turned.normal(), {-0.1, -0.3, 1});
}

/// The frame is that of u, made perpendicular to the normal.
TEST(NormalMap, SkewCoordinatesKeepTheDirectionOfU) {
  MappedCard mapped;
  mapped.mesh = card_with([](float x, float y) { return std::array{x, x + y}; });  // u grows along (1, -1)
  const Vec3d t = glm::normalize(Vec3d(1, -1, 0)), b = glm::cross(Vec3d(0, 0, 1), t);
  expect_direction(mapped.normal(), t * 0.3 + b * 0.1 + Vec3d(0, 0, 1));
}

TEST(NormalMap, InterpolatedNormalsCarryTheFrame) {
  MappedCard mapped;
  const Vec3d n = glm::normalize(Vec3d(0.4, -0.3, 1));
  mapped.mesh.normals.assign(4, {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
  const Vec3d t = glm::normalize(Vec3d(1, 0, 0) - n * n.x), b = glm::cross(n, t);
  expect_direction(mapped.normal(), t * 0.3 + b * 0.1 + n);
  // A ray from behind the normal sees the same one.
  expect_direction(MappedCard::normal_at(*mapped.compiled(), {-6.7, 0.6, 1}, {7, 0, -1}), t * 0.3 + b * 0.1 + n);
}

TEST(NormalMap, TangentsOfAMeshCountWithTheirSign) {
  for (const float sign : {1.0f, -1.0f}) {
    MappedCard mapped;
    mapped.mesh.tangents.assign(4, {0, 1, 0, sign});
    const Vec3d b = glm::cross(Vec3d(0, 0, 1), Vec3d(0, 1, 0)) * double{sign};
    expect_direction(mapped.normal(), Vec3d(0, 0.3, 1) + b * 0.1);
  }
}

TEST(NormalMap, TangentsOfTheTextureCoordinatesAreThoseOfAMeshThatGivesThem) {
  for (const bool mirrored : {false, true}) {
    MappedCard derived;
    derived.mesh = card_with([&](float x, float y) { return std::array{x, mirrored ? -y : y}; });
    MappedCard given = derived;
    given.mesh.tangents.assign(4, {1, 0, 0, mirrored ? -1.0f : 1.0f});
    expect_direction(given.normal(), derived.normal());
  }
}

/// Copies of small meshes, and instances of large ones.
TEST(NormalMap, TransformsMoveTheNormalsWithTheSurface) {
  const double c = std::cos(0.5), s = std::sin(0.5);
  const Vec3d from_texel = glm::normalize(Vec3d(0.3, 0.1, 1));
  for (const std::uint32_t squares : {1u, 8u}) {
    for (const double mirror : {1.0, -1.0}) {
      for (const bool tangents : {false, true}) {
        MappedCard mapped;
        mapped.mesh = card(squares);
        if (tangents) {
          mapped.mesh.tangents.assign(mapped.mesh.positions.size(), {1, 0, 0, 1});
        }
        const Vec3d x(2 * c * mirror, 2 * s * mirror, 0), y(0, 0, 2), z(2 * s, -2 * c, 0);
        mapped.transforms = {linear(x, y, z, {0.1, 0.2, 0.3}), linear({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {8, 0, 0})};
        expect_direction(mapped.normal(), x * from_texel.x + y * from_texel.y + z * from_texel.z, 2e-6);
      }
    }
  }
}

TEST(NormalMap, PlanesHaveThePlanesTangents) {
  MappedCard mapped;
  mapped.plane = PlaneShape{{0, 0, 0}, {0, 0, 1}};
  expect_direction(MappedCard::normal_at(*mapped.compiled(), {0.3, 0.6, 1}, {0, 0, -1}), {0.3, 0.1, 1});
}

TEST(NormalMap, WithoutTextureCoordinatesNormalsStay) {
  MappedCard mapped;
  mapped.mesh.texture_coordinates.assign(4, {0.5f, 0.5f});
  EXPECT_EQ(mapped.normal(), Vec3d(0, 0, 1));
  mapped.mesh.texture_coordinates.clear();
  EXPECT_EQ(mapped.normal(), Vec3d(0, 0, 1));
}

/// Texels may point anywhere, and may be no normals at all.
TEST(NormalMap, NormalsStayInFrontOfTheSurface) {
  for (const Vec3d& texel : {Vec3d(1, 0.5, 0.5), Vec3d(0, 0, 0), Vec3d(0.5, 0.5, 0), Vec3d(0.5, 0.5, 0.5),
                             Vec3d(1e30, 0, 0), Vec3d(-1e38, 1e38, 1)}) {
    MappedCard mapped;
    mapped.texels = image_of(1, 1, [&](double, double) { return texel; });
    const Vec3d n = mapped.normal();
    EXPECT_NEAR(glm::length(n), 1, 1e-5) << texel.x;
    EXPECT_GT(n.z, NormalMaps::kMinCosine - 1e-5) << texel.x;
  }
  MappedCard mapped;
  mapped.texels = image_of(1, 1, [&](double, double) { return texel_of({1, 0, 0}); });
  expect_direction(mapped.normal(),
                   {std::sqrt(1 - NormalMaps::kMinCosine * NormalMaps::kMinCosine), 0, NormalMaps::kMinCosine});
}

constexpr double kTwoPi = 6.283185307179586;

/// Heights h(u, v) with a known gradient.
double wave(double u, double v) {
  return 0.5 + 0.3 * std::sin(kTwoPi * u) * std::cos(kTwoPi * 2 * v);
}
Vec3d wave_gradient(double u, double v) {
  return {0.3 * kTwoPi * std::cos(kTwoPi * u) * std::cos(kTwoPi * 2 * v),
          -0.6 * kTwoPi * std::sin(kTwoPi * u) * std::sin(kTwoPi * 2 * v), 0};
}

MappedCard waves(double height) {
  MappedCard mapped;
  mapped.texels = image_of(512, 512, [](double u, double v) { return Vec3d(wave(u, v), 0, 0.7); });
  mapped.bump = BumpMap{{0, ScalarMap::Channel::r}, height};
  return mapped;
}

/// The slope is averaged over one texel, and linear between texels: its error is below 1e-4 of the largest here.
TEST(BumpMap, NormalsAreThoseOfTheHeightField) {
  MappedCard mapped = waves(0.2);
  for (const auto& [x, y] : {std::pair(0.3, 0.6), {0.71, 0.11}, {0.95, 0.42}, {0.05, 0.87}}) {
    expect_direction(mapped.normal(x, y), Vec3d(0, 0, 1) - 0.2 * wave_gradient(x, y), 3e-4);
  }
  mapped.bump->height = -0.2;
  expect_direction(mapped.normal(0.3, 0.6), Vec3d(0, 0, 1) + 0.2 * wave_gradient(0.3, 0.6), 3e-4);
  mapped.bump->map.channel = ScalarMap::Channel::b;
  EXPECT_EQ(mapped.normal(0.3, 0.6), Vec3d(0, 0, 1));
}

TEST(BumpMap, RotatedTextureCoordinatesRotateTheSlopes) {
  MappedCard mapped = waves(0.2);
  mapped.image.scale = {2, 3};
  mapped.image.rotation_degrees = 30;
  const double c = std::cos(std::numbers::pi / 6), s = 0.5, x = 0.3, y = 0.6;
  const Vec3d inner = wave_gradient(c * 2 * x - s * 3 * y, s * 2 * x + c * 3 * y);
  const Vec3d gradient(2 * (c * inner.x + s * inner.y), 3 * (c * inner.y - s * inner.x), 0);
  expect_direction(mapped.normal(x, y), Vec3d(0, 0, 1) - 0.2 * gradient, 6e-4);
}

/// The height is in scene units, however large the surface and however the image is repeated on it.
TEST(BumpMap, HeightsAreInSceneUnits) {
  MappedCard mapped = waves(0.2);
  mapped.image.scale = {2, -3};
  mapped.image.offset = {0.1, 0.2};
  const Vec3d inner = wave_gradient(2 * 0.3 + 0.1, -3 * 0.6 + 0.2);
  expect_direction(mapped.normal(0.3, 0.6), Vec3d(0, 0, 1) - 0.2 * Vec3d(2 * inner.x, -3 * inner.y, 0), 6e-4);
  for (const std::uint32_t squares : {1u, 8u}) {
    MappedCard large = waves(0.2);
    large.mesh = card(squares);
    const Vec3d moved(0.1, 0.2, 0.3);
    large.transforms = {linear({-4, 0, 0}, {0, 0, 3}, {0, 5, 0}, moved),
                        linear({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {9, 9, 9})};
    const Vec3d g = wave_gradient(0.3, 0.6);
    expect_direction(large.normal(0.3, 0.6), Vec3d(0, 1, 0) - 0.2 * Vec3d(g.x / -4, 0, g.y / 3), 3e-4);
  }
}

TEST(BumpMap, SkewCoordinatesGiveTheSameSurface) {
  MappedCard mapped = waves(0.2);
  mapped.mesh = card_with([](float x, float y) { return std::array{x + 0.5f * y, 0.3f * x - y}; });
  const double x = 0.3, y = 0.6;
  const Vec3d g = wave_gradient(x + 0.5 * y, 0.3 * x - y);
  expect_direction(mapped.normal(x, y), Vec3d(0, 0, 1) - 0.2 * Vec3d(g.x + 0.3 * g.y, 0.5 * g.x - g.y, 0), 3e-4);
}

TEST(BumpMap, TangentsOfTheMeshAreIgnored) {
  MappedCard mapped = waves(0.2);
  mapped.mesh.tangents.assign(4, {0, 1, 0, -1});
  expect_direction(mapped.normal(0.3, 0.6), Vec3d(0, 0, 1) - 0.2 * wave_gradient(0.3, 0.6), 3e-4);
}

TEST(BumpMap, HeightsOnPlanesAreInSceneUnits) {
  MappedCard mapped = waves(0.2);
  mapped.plane = PlaneShape{{0, 0, 0}, {0, 0, 1}};
  expect_direction(MappedCard::normal_at(*mapped.compiled(), {0.3, 0.6, 1}, {0, 0, -1}),
                   Vec3d(0, 0, 1) - 0.2 * wave_gradient(0.3, 0.6), 3e-4);
}

/// A white card in the plane z = 0 whose normal map leans up, in the sun from 45 degrees above. `tangents`: of glTF.
std::string leaning_card(const std::vector<float>& tangents) {
  GltfBuffer buffer;
  buffer.positions({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0});
  buffer.add(packed<float>({0, 1, 1, 1, 1, 0, 0, 0}), "VEC2", 5126, 4);
  buffer.indices({0, 1, 2, 0, 2, 3});
  if (!tangents.empty()) {
    buffer.add(packed(tangents), "VEC4", 5126, 4);
  }
  const std::string png = *encode_png(1, 1, std::vector<std::uint8_t>{128, 218, 218});
  return gltf(fmt::format(
      R"({},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1{}}},"indices":2,"material":0}}]}}],
"images":[{{"uri":"data:image/png;base64,{}"}}],"textures":[{{"source":0}}],
"materials":[{{"pbrMetallicRoughness":{{"metallicFactor":0}},"normalTexture":{{"index":0}},
"extensions":{{"KHR_materials_specular":{{"specularFactor":0}}}}}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":1}}}}],
"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"directional","intensity":683}}]}}}},
"nodes":[{{"mesh":0}},{{"camera":0,"translation":[0,0,3]}},
{{"rotation":[-0.38268343,0,0,0.92387953],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}])",
      buffer.embedded(), tangents.empty() ? "" : R"(,"TANGENT":3)", base64(png)));
}

TEST(NormalMap, AGltfFileShowsItInThePicture) {
  const double y = 2 * 218 / 255.0 - 1, x = 1 / 255.0, cosine = std::sqrt(0.5) * 2 * y / std::hypot(x, y, y);
  const auto shown = [](const std::vector<float>& tangents) {
    const TemporaryFolder folder;
    const auto path = folder.path() / "card.gltf";
    std::ofstream(path) << leaning_card(tangents);
    return mean_of(TestScene(path, read_image).resized(8, 8).render({"raycast", 1, 0}, 1), 0).value;
  };
  EXPECT_NEAR(shown({}), cosine / M_PI, 1e-5);
  EXPECT_NEAR(shown({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}), cosine / M_PI, 1e-5);
  EXPECT_NEAR(shown({1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1}), 0, 1e-5);
}

}  // namespace
}  // namespace lightmill::test
