// Methods show the same picture of surfaces with normal maps. Light paths scatter there by the adjoint of what camera
// paths do.
#include "common/sampling/sobol.h"
#include "tests/analytic/meter_text.h"
#include "tests/statistical/round_room.h"

namespace lightmill::test {
namespace {

/// 16×16 texels with normals up to 45 degrees off.
Result<Texels> bumps(ByteView /*bytes*/, const std::string& /*name*/) {
  std::vector<float> texels;
  for (std::uint32_t i = 0; i < 256; ++i) {
    const double x = (mix(2 * i + 1) >> 8) * 0x1p-23 - 1, y = (mix(2 * i + 2) >> 8) * 0x1p-23 - 1;
    const Vec3 texel((glm::normalize(Vec3d(0.7 * x, 0.7 * y, 1)) + 1.0) * 0.5);
    texels.insert(texels.end(), {texel.x, texel.y, texel.z, 1});
  }
  return Texels{16, 16, {}, std::move(texels), false};
}

/// A smooth ball with longitude and latitude as texture coordinates, two turns around.
std::string ball(const Vec3d& center, double radius) {
  constexpr int kRings = 24, kSegments = 32;
  std::string text;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int segment = 0; segment <= kSegments; ++segment) {
      const double theta = M_PI * ring / kRings, phi = 2 * M_PI * segment / kSegments;
      const Vec3d n(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi));
      const Vec3d p = center + n * radius;
      text += fmt::format("v {:.9g} {:.9g} {:.9g}\nvn {:.9g} {:.9g} {:.9g}\nvt {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z,
                          2.0 * segment / kSegments, 1 - 1.0 * ring / kRings);
    }
  }
  for (int ring = 0; ring < kRings; ++ring) {
    for (int segment = 0; segment < kSegments; ++segment) {
      const int a = ring * (kSegments + 1) + segment + 1, b = a + kSegments + 1;
      text += fmt::format("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2} {3}/{3}/{3}\n", a, b, b + 1, a + 1);
    }
  }
  return text;
}

struct Ball {
  std::string kind;
  Vec3d center;
  double radius;
};

/// A round room with an emitter and bumpy balls. Nothing touches, so there are no edges for gathering to blur.
TestScene bumpy_room(const std::vector<Ball>& balls) {
  std::string materials = diffuse("room", 0.6) + also(diffuse("lamp", 0, 9)), objects;
  objects = sphere("room", "[0, 0, 0]", 3, true) + also(sphere("lamp", "[0, 1.9, 0]", 0.5));
  std::map<std::string, std::string> files{{"bumps.exr", "normals"}};
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const std::string name = fmt::format("ball{}", i);
    materials += also(named(name, balls[i].kind + R"(, "normal_map": {"texture": "bumps"})"));
    objects += also(mesh(name, name + ".obj"));
    files[name + ".obj"] = ball(balls[i].center, balls[i].radius);
  }
  std::string text = document(R"("eye": [0, 0.3, 2.6], "look_at": [0, -0.1, 0])", 60, kFilm, materials, objects);
  text.insert(1, R"("textures": [{"name": "bumps", "file": "bumps.exr"}], )");
  return TestScene::from_text(text, files, bumps);
}

const Ball kMatt{R"("diffuse": {"reflectance": {"rgb": [0.8, 0.7, 0.6]}})", {0, -0.9, 0.6}, 0.6};
const Ball kMirror{R"("mirror": {"reflectance": {"rgb": [0.9, 0.8, 0.7]}})", {0.9, -0.1, 0}, 0.6};
const Ball kGlass{R"("dielectric": {"ior": 1.5})", {-0.9, -0.1, 0}, 0.6};
const Ball kGold{R"("conductor": {"metal": "gold", "roughness": 0.5})", {0.8, 0.8, -1}, 0.5};
const Ball kPlastic{R"("principled": {"base_color": {"rgb": [0.9, 0.6, 0.7]}, "roughness": 0.5, "coat": 1,
                       "coat_roughness": 0})",
                    {-0.8, 0.9, -1},
                    0.5};
const Ball kSoap{R"("principled": {"base_color": {"rgb": [0.9, 0.6, 0.7]}, "roughness": 0.5, "transmission": 0.7})",
                 {0, 0.6, -1.2},
                 0.4};

TEST(NormalMaps, CausticMatchesPath) {
  expect_same(bumpy_room({kMatt, kMirror, kGlass}), {.method = "caustic:photons=4000"});
}

TEST(NormalMaps, PpmMatchesPath) {
  expect_same(bumpy_room({kMatt, kGold, kPlastic}), {.method = "ppm:photons=6000", .precision = 0.02, .blur = 0.01});
}

TEST(NormalMaps, VcmMatchesPath) {
  expect_same(bumpy_room({kMatt, kMirror, kSoap}), {.method = "vcm:photons=1500", .blur = 0.005});
}

/// An emitter over a bumpy ball, and a meter below. The readings agree to 5 standard errors (a false alarm once in a
/// million).
TEST(NormalMaps, AllMethodsReadTheSameIrradianceBelowABall) {
  for (const Ball& b : {kGlass, kMirror, kMatt}) {
    const TestScene scene = scene_with(
        R"("textures": [{"name": "bumps", "file": "bumps.exr"}], "materials": [)" + diffuse("lamp", 0, 9) +
            also(named("ball", b.kind + R"(, "normal_map": {"texture": "bumps"})")) + R"(], "objects": [)" +
            sphere("lamp", "[0.5, 3, 0]", 1.2) + also(mesh("ball", "ball.obj")) + R"(], "meters": [{"name": "below",
                       "patch": {"corner": [-1.5, -1, -1.5], "edge1": [0, 0, 3], "edge2": [3, 0, 0]}}])",
        {{"ball.obj", ball({0, 0.3, 0}, 0.9)}, {"bumps.exr", "normals"}}, bumps);
    const MeterReading path = read_meters(scene, 5, 3, bumps)[0];
    EXPECT_LT(path.half_width, 0.02 * path.value);
    for (const char* method : {"caustic:photons=20000", "ppm:photons=20000", "vcm:photons=10000"}) {
      const MeterReading other = read_meters(scene, 5, 3, bumps, method)[0];
      EXPECT_LT(other.half_width, 0.06 * path.value) << method << b.kind;
      EXPECT_NEAR(other.value, path.value, 5 / 1.96 * std::hypot(path.half_width, other.half_width))
          << method << b.kind;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
