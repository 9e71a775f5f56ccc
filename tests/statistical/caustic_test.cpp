// `caustic` traces some light from the lights and the rest from the camera. Where `path` can find all light, both must
// show the same picture.
#include "tests/statistical/same_picture.h"

namespace lightmill::test {
namespace {

void expect_same(const TestScene& scene, double precision, std::uint32_t bounces = 0,
                 const std::string& method = "caustic") {
  expect_same(scene, {.method = method, .precision = precision, .bounces = bounces});
}

/// A floor, two walls, an emitter and the objects between them. Each part of the document can be replaced.
struct Room {
  std::string view = R"("eye": [0, 1.6, 4], "look_at": [0, 0.7, 0])";
  std::string floor = R"("diffuse": {"reflectance": {"rgb": [0.7, 0.6, 0.5]}})";
  std::string materials;  ///< with names; `caster` is among them
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

TEST(Caustic, MatchesPathForMirrorAndGlassBalls) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(named("mirror", R"("mirror": {})"));
  room.objects = sphere("caster", "[-0.8, 0.7, 0]", 0.6) + also(sphere("mirror", "[0.8, 0.7, 0]", 0.6));
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathOnBothSidesOfTheRoughnessThreshold) {
  for (const double roughness : {0.31, 0.32}) {
    Room room;
    room.materials = caster(fmt::format(R"("conductor": {{"metal": "gold", "roughness": {}}})", roughness));
    expect_same(room.scene(), 0.01);
  }
}

TEST(Caustic, MatchesPathForRoughGlass) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5, "roughness": 0.2})");
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathForAbsorbingGlass) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5}, "interior": {"absorption": {"rgb": [0.2, 1, 3]}})");
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathForSeveralEmittersAndAConstantSky) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(diffuse("bulb", 0, 6));
  room.objects += also(sphere("bulb", "[1.5, 1.2, 0.5]", 0.3));
  room.more_lights = R"({"environment": {"radiance": {"rgb": [0.2, 0.3, 0.5]}}})";
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathThroughALens) {
  Room room;
  room.view = R"("eye": [0, 1.6, 4], "look_at": [0, 0.7, 0], "lens_radius": 0.2, "focus_distance": 3)";
  room.materials = caster(R"("dielectric": {"ior": 1.5})");
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathOnPhongAndPrincipledReceivers) {
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

TEST(Caustic, MatchesPathInAMirror) {
  Room room;
  room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(named("mirror", R"("mirror": {})"));
  room.objects += also(mesh("mirror", "mirror.obj"));
  room.files["mirror.obj"] = polygon({{-2.4, 0, -1.5}, {2.4, 0, -1.5}, {2.4, 3, -2}, {-2.4, 3, -2}});
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathFromWithinGlass) {
  Room room;
  room.view = R"("eye": [0, 1.2, 0.3], "look_at": [0, 0, -0.2])";
  room.materials = caster(R"("dielectric": {"ior": 1.3}, "interior": {"absorption": {"rgb": [0.1, 0.3, 0.5]}})");
  room.objects = sphere("caster", "[0, 1.1, 0.2]", 0.6);
  expect_same(room.scene(), 0.01);
}

TEST(Caustic, MatchesPathWithFewBounces) {
  for (const std::uint32_t bounces : {2u, 3u, 4u}) {
    Room room;
    room.materials = caster(R"("dielectric": {"ior": 1.5})") + also(named("mirror", R"("mirror": {})"));
    room.objects = sphere("caster", "[-0.8, 0.7, 0]", 0.6) + also(sphere("mirror", "[0.8, 0.7, 0]", 0.6));
    expect_same(room.scene(), 0.01, bounces);
  }
}

}  // namespace
}  // namespace lightmill::test
