// Anisotropic metal and sheen through public scene documents, compared with the published formulas. The formulas use
// double precision and no code of the renderer.
#include <cmath>

#include "tests/analytic/materials/published_formulas.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// A square of side 20 in the plane y = 0, facing up. u is `turn` degrees from x towards −z, and v perpendicular to it.
std::string turned_floor(double turn, bool mirrored = false) {
  std::string text;
  const double c = std::cos(turn * M_PI / 180), s = std::sin(turn * M_PI / 180);
  for (const auto& [x, z] : {std::pair(-8.0, 11.0), {12.0, 11.0}, {12.0, -9.0}, {-8.0, -9.0}}) {
    text += fmt::format("v {} 0 {}\nvt {} {}\n", x, z, x * c - z * s, (mirrored ? -1 : 1) * (-x * s - z * c));
  }
  return text + "f 1/1 2/2 3/3 4/4\n";
}

/// f cos θi of white metal as KHR_materials_anisotropy writes it. x is the direction along which it is rougher.
double brushed_formula(double roughness, double strength, const Vec3d& x, const Vec3d& wo, const Vec3d& wi) {
  const double ab = roughness * roughness, at = ab * (1 - strength * strength) + strength * strength;
  const Vec3d n(0, 1, 0), y = glm::cross(n, x), h = glm::normalize(wo + wi);
  const Vec3d f(ab * glm::dot(x, h), at * glm::dot(y, h), at * ab * h.y);
  const double w2 = at * ab / glm::dot(f, f), d = at * ab * w2 * w2 / M_PI;
  const auto length = [&](const Vec3d& w) { return glm::length(Vec3d(at * glm::dot(x, w), ab * glm::dot(y, w), w.y)); };
  return d * 0.5 / (wi.y * length(wo) + wo.y * length(wi)) * wi.y;
}

const Vec3d kLight(0.4, 1.5, -0.3), kEye(-0.6, 1.2, 0.5);

/// The radiance of the origin of a floor by a point light of intensity 2, over f cos θi.
double seen(const std::string& kind, const std::string& floor, const char* method, const std::string& transform = "") {
  const std::string view =
      fmt::format(R"("eye": [{}, {}, {}], "look_at": [0, 0, 0], "up": [1, 0, 0])", kEye.x, kEye.y, kEye.z);
  const TestScene scene = TestScene::from_text(
      document(view, 0.01, 8, named("floor", kind), shape("floor", R"("mesh": {"file": "floor.obj"})", transform),
               fmt::format(R"({{"point": {{"position": [{}, {}, {}], "intensity": {}}}}})", kLight.x, kLight.y,
                           kLight.z, gray(2))),
      {{"floor.obj", floor}});
  return mean_of(scene.render({method, 20, 1}, 4), 0).value / (2 / glm::dot(kLight, kLight));
}

Vec3d turned(double degrees) {
  return {std::cos(degrees * M_PI / 180), 0, -std::sin(degrees * M_PI / 180)};
}

TEST(BrushedFloor, ShowsAPointLightByItsFormula) {
  const Vec3d wo = glm::normalize(kEye), wi = glm::normalize(kLight);
  struct Case {
    double turn, rotation;
    bool mirrored;
    std::string transform;
    double direction;  ///< of the anisotropy, from x towards −z
  };
  const std::string quarter = R"({"rotate": {"axis": [0, 1, 0], "degrees": 90}})";
  for (const Case& c : std::vector<Case>{{0, 0, false, "", 0},
                                         {30, 0, false, "", 30},
                                         {0, 30, false, "", 30},
                                         {20, -50, false, "", -30},
                                         {20, -50, true, "", 70},
                                         {10, 15, false, quarter, 115}}) {
    const double exact = brushed_formula(0.4, 0.7, turned(c.direction), wo, wi);
    const std::string parameters = fmt::format(
        R"("roughness": 0.4, "anisotropy": 0.7, "anisotropy_rotation_degrees": {}}}, "single_scattering": true)",
        c.rotation);
    for (const char* kind : {R"("conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [1000, 1000, 1000]}, )",
                             R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "metallic": 1, )"}) {
      for (const char* method : {"path", "raycast"}) {
        EXPECT_NEAR(seen(kind + parameters, turned_floor(c.turn, c.mirrored), method, c.transform), exact, 1e-3 * exact)
            << c.turn << " " << c.rotation << " " << c.mirrored << " " << method << kind;
      }
    }
  }
}

/// A wall of n² squares over [0, 1]² in the plane z = 0.
Mesh wall(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      mesh.positions.push_back({x / static_cast<double>(n), y / static_cast<double>(n), 0});
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

/// The direction of the anisotropy where a ray from +z hits (0.3, 0.6) of the first object. Zero if there is none.
Vec3d direction_of(const Mesh& mesh, double rotation, const std::vector<Transform>& transforms = {kIdentityTransform}) {
  Scene scene;
  scene.camera = {{0, 0, 20}, {0, 0, 0}};
  scene.materials = {{"brushed", ConductorMaterial{{1, 1, 1}, {9, 9, 9}, 0.3, {0.5, rotation}}, {}}};
  const std::string bytes = encode_mesh(mesh);
  for (const Transform& transform : transforms) {
    scene.objects.push_back({"wall", 0, MeshShape{"", sha256(bytes)}, transform});
  }
  const auto compiled = CompiledScene::compile(scene, [&](const Sha256&) -> Result<std::string> { return bytes; });
  EXPECT_TRUE(compiled.ok()) << message_of(compiled.status());
  const Transform& t = transforms[0];
  const Vec3d at(t[0][0] * 0.3 + t[0][1] * 0.6 + t[0][3], t[1][0] * 0.3 + t[1][1] * 0.6 + t[1][3], 1);
  const Ray8 ray{broadcast(Vec3((*compiled)->frame().to_frame(at))), broadcast({0, 0, -1}),
                 F8(std::numeric_limits<float>::infinity())};
  const Hit8 hit = (*compiled)->accel().intersect(first_lanes(1), ray, false);
  EXPECT_EQ(hit.hit.bits(), 1);
  const Surface8 surface = (*compiled)->surface(ray, hit);
  return surface.directed.bits() == 1 ? Vec3d(VectorLanes(surface.tangent)[0]) : Vec3d(0);
}

void expect_direction(const Vec3d& got, const Vec3d& expected) {
  EXPECT_LT(glm::length(got - expected), 1e-5) << fmt::format("({}, {}, {})", got.x, got.y, got.z);
}

/// The meshes have texture coordinates or none. Small ones are copied, and large ones are instances. One is mirrored.
TEST(AnisotropyDirection, FollowsTheMeshesTangents) {
  const double c = std::sqrt(0.5);
  for (const std::uint32_t squares : {1u, 64u}) {
    for (const bool coordinates : {false, true}) {
      Mesh mesh = wall(squares);
      mesh.tangents.assign(mesh.positions.size(), {0, 1, 0, 1});
      if (coordinates) {
        for (const auto& p : mesh.positions) {
          mesh.texture_coordinates.push_back({static_cast<float>(p[0]), static_cast<float>(p[1])});
        }
      }
      const Transform mirror{{{-1, 0, 0, 0.7}, {0, 1, 0, -2}, {0, 0, 1, 0}}},
          turn{{{0, -1, 0, 2}, {1, 0, 0, 5}, {0, 0, 1, 0}}};
      expect_direction(direction_of(mesh, 0), {0, 1, 0});
      expect_direction(direction_of(mesh, 90), {-1, 0, 0});
      expect_direction(direction_of(mesh, 0, {mirror, turn}), {0, 1, 0});
      expect_direction(direction_of(mesh, 45, {mirror, turn}), {c, c, 0});
      expect_direction(direction_of(mesh, 45, {turn, mirror}), {-c, -c, 0});
    }
  }
}

TEST(AnisotropyDirection, NeedsTangentsOrTextureCoordinates) {
  expect_direction(direction_of(wall(1), 30), Vec3d(0));
  Mesh point = wall(1);
  point.texture_coordinates.assign(point.positions.size(), {0.5f, 0.5f});
  expect_direction(direction_of(point, 30), Vec3d(0));
}

/// Without texture coordinates there is no direction. The lobe has the root of both alphas' product.
TEST(BrushedFloor, WithoutADirectionItIsIsotropic) {
  const Vec3d wo = glm::normalize(kEye), wi = glm::normalize(kLight);
  const double along = 0.16 * (1 - 0.49) + 0.49, alpha = std::sqrt(0.16 * along);
  const double exact = brushed_formula(std::sqrt(alpha), 0, {1, 0, 0}, wo, wi);
  EXPECT_NEAR(
      seen(
          R"("conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [1000, 1000, 1000]}, "roughness": 0.4, "anisotropy": 0.7},
"single_scattering": true)",
          plane(20, 0, true), "path"),
      exact, 1e-3 * exact);
}

TEST(ClothFloor, ShowsAPointLightByItsFormula) {
  const Vec3d wo = glm::normalize(kEye), wi = glm::normalize(kLight);
  for (const double roughness : {0.3, 0.6, 1.0}) {
    const double exact = 0.8 * sheen_formula(roughness, wo, wi);
    for (const char* method : {"path", "raycast"}) {
      EXPECT_NEAR(seen(fmt::format(R"("principled": {{"base_color": {}, "specular": 0, "sheen_color": {},
"sheen_roughness": {}}})",
                                   gray(0), gray(0.8), roughness),
                       plane(20, 0, true), method),
                  exact, 1e-3 * exact + 1e-6)
          << roughness;
    }
  }
}

TEST(WhiteFurnace, ClothAndBrushedCubesAreInvisibleToEveryMethod) {
  const std::string white = R"("principled": {"base_color": {"rgb": [1, 1, 1]}, )";
  for (const std::string& kind :
       {white + R"("roughness": 0.8, "sheen_color": {"rgb": [1, 1, 1]}, "sheen_roughness": 0.5})",
        white + R"("roughness": 0.5, "anisotropy": 0.6})",
        white + R"("metallic": 1, "roughness": 0.4, "anisotropy": 0.8, "sheen_color": {"rgb": [0.5, 0.5, 0.5]}})"}) {
    // All walls have texture coordinates, so there is a direction.
    const std::string cube =
        "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        "f 4/1 3/2 2/3 1/4\nf 5/1 6/2 7/3 8/4\nf 1/1 2/2 6/3 5/4\nf 3/1 4/2 8/3 7/4\nf 1/1 5/2 8/3 4/4\nf 2/1 3/2 7/3 6/4\n";
    const TestScene scene =
        TestScene::from_text(document(R"("eye": [2.2, 1.7, 2.6], "look_at": [0, 0, 0])", 35, 16, named("cube", kind),
                                      mesh("cube", "cube.obj"), R"({"environment": {"radiance": {"rgb": [1, 1, 1]}}})"),
                             {{"cube.obj", cube}});
    for (const char* method : {"path", "caustic:photons=2000", "vcm:photons=2000"}) {
      const Estimate seen = mean_of(scene.render({method, 37, 0}, 8), 0);
      EXPECT_LT(seen.standard_error, 4e-3) << kind << method;
      EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 0.012) << kind << method;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
