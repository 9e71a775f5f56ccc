// `caustic` and `path` share a picture's light between two sides and one: where paths can find all of it, both must
// show the same.
//
// Of each scene 192 block means and the means of the whole picture are compared, from 16 seeds each. Standard errors
// come from the spread over seeds, so that a |z| follows Student's distribution with some 30 degrees of freedom: above
// 6 anywhere in a scene is a false alarm once in 2,600 runs, a whole picture's above 5 once in 16,000. The seeds are
// fixed, so a run that passes stays so.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

constexpr int kFilm = 64, kBlocks = 8, kSeeds = 16;

/// By seed: block means, then the picture's means; channels innermost.
std::vector<std::vector<double>> pictures(const TestScene& scene, const std::string& method, std::uint32_t bounces) {
  std::vector<std::vector<double>> out;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const HalfImages image = scene.render({method, 300 + seed, bounces}, 4);
    EXPECT_EQ(image.non_finite, 0u);
    std::vector<double>& means = out.emplace_back(3 * (kBlocks * kBlocks + 1), 0.0);
    constexpr int kSide = kFilm / kBlocks;
    for (int y = 0; y < kFilm; ++y) {
      for (int x = 0; x < kFilm; ++x) {
        for (int c = 0; c < 3; ++c) {
          const double value = image.mean((y * kFilm + x) * 3 + c);
          means[3 * (y / kSide * kBlocks + x / kSide) + c] += value / (kSide * kSide);
          means[3 * kBlocks * kBlocks + c] += value / (kFilm * kFilm);
        }
      }
    }
  }
  return out;
}

Estimate estimate(const std::vector<std::vector<double>>& seeds, std::size_t i) {
  double sum = 0, squares = 0;
  for (const auto& seed : seeds) {
    sum += seed[i] / kSeeds;
  }
  for (const auto& seed : seeds) {
    squares += (seed[i] - sum) * (seed[i] - sum);
  }
  return {sum, std::sqrt(squares / (kSeeds - 1) / kSeeds)};
}

void expect_same(const TestScene& scene, double precision, std::uint32_t bounces = 0,
                 const std::string& method = "caustic") {
  const auto a = pictures(scene, "path", bounces), b = pictures(scene, method, bounces);
  for (std::size_t i = 0; i < a.front().size(); ++i) {
    const Estimate p = estimate(a, i), c = estimate(b, i);
    const bool whole = i >= 3 * kBlocks * kBlocks;
    const double error = std::hypot(p.standard_error, c.standard_error);
    EXPECT_NEAR(c.value, p.value, (whole ? 5 : 6) * error + 1e-4 * p.value)
        << (whole ? "whole" : "block") << ' ' << i / 3 << " channel " << i % 3;
    if (whole) {
      EXPECT_LT(error, precision * p.value) << "the test says little";
      if (std::getenv("LIGHTMILL_SHOW") != nullptr) {
        fmt::print("{:.5f} ± {:.5f}, {:.5f} ± {:.5f}\n", p.value, p.standard_error, c.value, c.standard_error);
      }
    }
  }
}

/// A floor, two walls, a lamp and what stands between; each part of a document may be replaced.
struct Room {
  std::string view = R"("eye": [0, 1.6, 4], "look_at": [0, 0.7, 0])";
  std::string floor = R"("diffuse": {"reflectance": {"rgb": [0.7, 0.6, 0.5]}})";
  std::string materials;  ///< named; `caster` among them
  std::string objects = sphere("caster", "[0, 0.8, 0]", 0.6);
  std::string more_lights;
  std::map<std::string, std::string> files;

  TestScene scene() const {
    auto all = files;
    all["floor.obj"] = horizontal_square(5, 0, true);
    all["back.obj"] = polygon({{-2.5, 0, -2.5}, {2.5, 0, -2.5}, {2.5, 4, -2.5}, {-2.5, 4, -2.5}});
    all["lamp.obj"] = horizontal_square(1.4, 3.5, false);
    return TestScene::from_text(
        document(view, 50, kFilm,
                 named("floor", floor) + "," + diffuse("back", 0.5) + "," + diffuse("lamp", 0, 8) + "," + materials,
                 mesh("floor", "floor.obj") + "," + mesh("back", "back.obj") + "," + mesh("lamp", "lamp.obj") + "," +
                     objects,
                 more_lights),
        all);
  }
};

std::string caster(const std::string& kind) {
  return named("caster", kind);
}

TEST(Caustic, OfMirrorAndGlassBalls) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(named("mirror", R"("mirror": {})"));
  room.objects = sphere("caster", "[-0.8, 0.7, 0]", 0.6) + also(sphere("mirror", "[0.8, 0.7, 0]", 0.6));
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, OfRoughCastersOnEitherSideOfTheThreshold) {
  for (const double roughness : {0.31, 0.32}) {
    Room room;
    room.materials = caster(fmt::format(R"("conductor": {{"metal": "gold", "roughness": {}}})", roughness));
    expect_same(room.scene(), 0.01);
  }
}

TEST(Caustic, OfRoughGlass) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5, "roughness": 0.2})");
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, OfAbsorbingGlass) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5}, "interior": {"absorption": {"rgb": [0.2, 1, 3]}})");
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, OfSeveralLampsAndASkyWithoutImage) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(diffuse("bulb", 0, 6));
  room.objects += also(sphere("bulb", "[1.5, 1.2, 0.5]", 0.3));
  room.more_lights = R"({"environment": {"radiance": {"rgb": [0.2, 0.3, 0.5]}}})";
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, ThroughALens) {
  Room room;
  room.view = R"("eye": [0, 1.6, 4], "look_at": [0, 0.7, 0], "lens_radius": 0.2, "focus_distance": 3)";
  room.materials = caster(R"("dielectric": {"ior": 1.5})");
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, OnPhongAndPrincipledReceivers) {
  for (
      const std::string floor :
      {R"("phong": {"diffuse": {"rgb": [0.3, 0.3, 0.4]}, "specular": {"rgb": [0.4, 0.4, 0.4]}, "exponent": 20})",
       R"("principled": {"base_color": {"rgb": [0.5, 0.6, 0.7]}, "roughness": 0.4})",
       R"("principled": {"base_color": {"rgb": [0.5, 0.6, 0.7]}, "roughness": 0.5, "coat": 1, "coat_roughness": 0})"}) {
    Room room;
    room.floor = floor;
    room.materials = caster(R"("mirror": {})");
    expect_same(room.scene(), 0.01);
  }
}

TEST(Caustic, SeenInAMirror) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(named("mirror", R"("mirror": {})"));
  room.objects += also(mesh("mirror", "mirror.obj"));
  room.files["mirror.obj"] = polygon({{-2.4, 0, -1.5}, {2.4, 0, -1.5}, {2.4, 3, -2}, {-2.4, 3, -2}});
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, SeenFromWithinGlass) {
  Room room;
  room.view = R"("eye": [0, 1.2, 0.3], "look_at": [0, 0, -0.2])";
  room.materials = caster(R"("dielectric": {"ior": 1.3}, "interior": {"absorption": {"rgb": [0.1, 0.3, 0.5]}})");
  room.objects = sphere("caster", "[0, 1.1, 0.2]", 0.6);
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, WithFewBounces) {
  for (const std::uint32_t bounces : {2u, 3u, 4u}) {
    Room room;
    room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(named("mirror", R"("mirror": {})"));
    room.objects = sphere("caster", "[-0.8, 0.7, 0]", 0.6) + also(sphere("mirror", "[0.8, 0.7, 0]", 0.6));
    expect_same(room.scene(), 0.01, bounces);
  }
}

}  // namespace
}  // namespace lightmill::test
