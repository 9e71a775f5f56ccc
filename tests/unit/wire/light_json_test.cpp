// Lights and emission in scene documents: values, units, mistakes, and the packed form.
#include <gtest/gtest.h>

#include "common/wire/scene_json.h"
#include "common/wire/scene_proto.h"

namespace lightmill {
namespace {

std::string light_document(const std::string& lights, const std::string& emission = "") {
  return fmt::format(R"({{"camera": {{"eye": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 40}},
"materials": [{{"name": "m", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}}{}}}],
"objects": [{{"material": "m", "sphere": {{"center": [0, 0, 0], "radius": 1}}}}],
"lights": [{}]}})",
                     emission, lights);
}

Scene scene_of(const std::string& text) {
  auto file = read_scene_json(text, "s.json");
  EXPECT_TRUE(file.ok()) << message_of(file.status());
  return file.ok() ? file->draft.scene : Scene();
}
std::string light_error(const std::string& text) {
  const auto file = read_scene_json(text, "s.json");
  if (file.ok()) {
    return "no error";
  }
  // Without the place "", which the tests of documents check.
  const std::string message = message_of(file.status());
  return message.substr(message.find(": ") + 2);
}
template <class Kind>
Kind light_of(const std::string& light) {
  const Scene scene = scene_of(light_document(light));
  EXPECT_EQ(scene.lights.size(), 1u);
  return scene.lights.empty() ? Kind() : std::get<Kind>(scene.lights[0].kind);
}

TEST(LightJson, ARectangleHasAWidthAndAHeight) {
  const auto size = [](const std::string& fields) {
    const auto light = light_of<DiskLight>(fmt::format(
        R"({{"rectangle": {{"position": [1, 2, 3], "direction": [0, -1, 0], "radiance": {{"rgb": [1, 1, 1]}}{}}}}})",
        fields));
    EXPECT_TRUE(light.rectangular);
    return std::array{2 * light.second_radius, 2 * light.radius};
  };
  EXPECT_EQ(size(""), (std::array{1.0, 1.0}));
  EXPECT_EQ(size(R"(, "width": 3)"), (std::array{3.0, 3.0}));
  EXPECT_EQ(size(R"(, "width": 3, "height": 2)"), (std::array{3.0, 2.0}));
  // Φ = πL · 3 · 2
  const auto disk = light_of<DiskLight>(
      R"({"rectangle": {"position": [1, 2, 3], "direction": [0, -1, 0], "width": 3, "height": 2}, "strength": {"watt": 12}})");
  EXPECT_NEAR(disk.radiance.r, 2 / M_PI, 1e-6);
  EXPECT_NE(light_error(light_document(
                            R"({"rectangle": {"position": [0, 2, 0], "direction": [0, -1, 0], "width": -1,
                                "radiance": {"rgb": [1, 1, 1]}}})"))
                .find("lights[0].rectangle.width: must be positive"),
            std::string::npos);
}

TEST(LightJson, DefaultsAreThoseOfTheSchema) {
  const auto spot = light_of<SpotLight>(
      R"({"spot": {"position": [1, 2, 3], "direction": [0, -1, 0], "intensity": {"rgb": [1, 2, 3]}}})");
  EXPECT_EQ(spot.cutoff_degrees, 45);
  EXPECT_EQ(spot.blend, 0);
  EXPECT_EQ(
      light_of<CosinePowerLight>(
          R"({"cosine_power": {"position": [1, 2, 3], "direction": [0, -1, 0], "intensity": {"rgb": [1, 2, 3]}}})")
          .exponent,
      1);
  const auto ies = light_of<IesLight>(R"({"ies": {"position": [1, 2, 3], "file": "lamp.ies"}})");
  EXPECT_EQ(ies.direction, (Point3d{0, -1, 0}));
  EXPECT_EQ(ies.up, (Point3d{1, 0, 0}));
  EXPECT_EQ(ies.scale, 1);
  EXPECT_EQ(light_of<IesLight>(R"({"ies": {"position": [1, 2, 3], "direction": [2, 0, 0], "file": "lamp.ies"}})").up,
            (Point3d{0, 0, 1}));
  const auto sky = light_of<EnvironmentLight>(R"({"environment": {}})");
  EXPECT_EQ(sky.radiance, (RgbColor{1, 1, 1}));
  EXPECT_FALSE(sky.has_image);
  const auto image =
      light_of<EnvironmentLight>(R"({"environment": {"file": "sky.hdr", "scale": 2, "rotation_degrees": -30}})");
  EXPECT_TRUE(image.has_image);
  EXPECT_EQ(image.radiance, (RgbColor{2, 2, 2}));
  EXPECT_EQ(image.rotation_degrees, -30);
  EXPECT_FALSE(image.equal_area || image.orientation);
}

TEST(LightJson, MistakesAreNamed) {
  EXPECT_EQ(light_error(light_document(R"({"environment": {"orientation": [1, 0, 0]}})")),
            "lights[0].environment.orientation: needs 9 numbers, got 3");
  EXPECT_EQ(light_error(light_document(R"({"environment": {"orientation": [1, 0, 0, 0, 1, 0, 0, 1, 0]}})")),
            "lights[0].environment.orientation: its rows must be perpendicular and of length 1");
  EXPECT_EQ(light_error(light_document(R"({"spot": {"position": [0, 0, 0], "intensity": {"rgb": [1, 1, 1]}}})")),
            "lights[0].spot.direction: must be given");
  EXPECT_EQ(
      light_error(light_document(R"({"directional": {"direction": [0, 0, 0], "irradiance": {"rgb": [1, 1, 1]}}})")),
      "lights[0].directional.direction: must not be zero");
  EXPECT_EQ(light_error(light_document(R"({"spot": {"position": [0, 0, 0], "direction": [0, 1, 0], "cutoff_degrees": 0,
                                           "intensity": {"rgb": [1, 1, 1]}}})")),
            "lights[0].spot.cutoff_degrees: must be in [0.001, 180], got 0");
  EXPECT_EQ(
      light_error(light_document(R"({"cosine_power": {"position": [0, 0, 0], "direction": [0, 1, 0], "exponent": -1,
                                                   "intensity": {"rgb": [1, 1, 1]}}})")),
      "lights[0].cosine_power.exponent: must be in [0, 10000], got -1");
  EXPECT_EQ(light_error(light_document(R"({"ies": {"position": [0, 0, 0], "up": [0, 2, 0], "file": "a"}})")),
            "lights[0].ies.up: must not be parallel to direction, got (0, 2, 0)");
  EXPECT_EQ(light_error(light_document(R"({"ies": {"position": [0, 0, 0]}})")), "lights[0].ies.file: must be given");
  EXPECT_EQ(light_error(light_document(R"({"environment": {}}, {"environment": {}})")),
            "lights[1].environment: at most one light can be an environment");
  EXPECT_EQ(light_error(light_document(R"({"environment": {"rotation_degrees": 361}})")),
            "lights[0].environment.rotation_degrees: must be in [-360, 360], got 361");
}

TEST(LightJson, MistakesInUnitsAreNamed) {
  const auto point = [](const std::string& rest) {
    return light_document(fmt::format(R"({{"point": {{"position": [0, 0, 0]}}, {}}})", rest));
  };
  EXPECT_EQ(light_error(point(R"("strength": {"lux": 3})")),
            "lights[0].strength.lux: one of the units watt, watt_per_steradian, lumen, candela is expected here");
  EXPECT_EQ(light_error(point(R"("strength": {})")),
            "lights[0].strength: must be given in one of the units watt, watt_per_steradian, "
            "lumen, candela");
  EXPECT_EQ(light_error(point(R"("strength": {"lumen": -3})")),
            "lights[0].strength.lumen: must be in [0, 1e+20], got -3");
  EXPECT_EQ(light_error(point(R"("strength": {"lumen": 3, "color": {"rgb": [0, 0, 0]}})")),
            "lights[0].strength.color: must not be black. An amount of 0 turns the light off");
  EXPECT_EQ(light_error(light_document(R"({"point": {"position": [0, 0, 0], "intensity": {"rgb": [1, 1, 1]}},
                                  "strength": {"lumen": 3}})")),
            "lights[0].strength: give either strength or point.intensity");
  EXPECT_EQ(light_error(light_document(R"({"ies": {"position": [0, 0, 0], "file": "a"}, "strength": {"lumen": 3}})")),
            "lights[0].strength: an IES file has its own strength: change it with ies.scale");
  EXPECT_EQ(light_error(light_document("", R"(, "emission_strength": {"candela": 1})")),
            "materials[0].emission_strength.candela: one of the units watt, watt_per_square_metre, "
            "watt_per_square_metre_steradian, lumen, lux, candela_per_square_metre is expected here");
  EXPECT_EQ(light_error(light_document("", R"(, "emission": {"rgb": [1, 1, 1]}, "emission_strength": {"watt": 1})")),
            "materials[0]: only one of emission, emission_strength and emission_flux can be given");
}

TEST(LightJson, PackedScenesKeepEveryLight) {
  Scene scene = scene_of(light_document(
      R"({"name": "a", "point": {"position": [1, 2, 3], "intensity": {"rgb": [1, 2, 3]}, "radius": 0.25}, "hidden_from_camera": true},
         {"directional": {"direction": [0, -2, 0], "irradiance": {"rgb": [4, 5, 6]}, "angle_degrees": 0.5}},
         {"spot": {"position": [1, 0, 0], "direction": [0, 0, 1], "cutoff_degrees": 30, "blend": 0.25,
                   "radius": 0.125},
          "strength": {"watt": 10}},
         {"cosine_power": {"position": [0, 1, 0], "direction": [1, 0, 0], "exponent": 3,
                           "intensity": {"rgb": [7, 8, 9]}}},
         {"ies": {"position": [0, 0, 1], "file": "lamp.ies", "scale": 0.5, "color": {"rgb": [1, 0.5, 0.25]}}},
         {"environment": {"file": "sky.exr", "radiance": {"rgb": [2, 3, 4]}, "rotation_degrees": 10,
                          "mapping": "EQUAL_AREA", "orientation": [0, 1, 0, 0, 0, 1, 1, 0, 0]}})",
      R"(, "emission_strength": {"watt": 5}, "emission_exponent": 2)"));
  std::get<IesLight>(scene.lights[4].kind).asset = sha256("profile");
  std::get<EnvironmentLight>(scene.lights[5].kind).asset = sha256("image");
  const std::string bytes = pack_scene(scene);
  const auto back = unpack_scene(bytes);
  ASSERT_TRUE(back.ok()) << message_of(back.status());
  EXPECT_EQ(pack_scene(*back), bytes);
  ASSERT_EQ(back->lights.size(), 6u);
  EXPECT_EQ(back->lights[0].name, "a");
  EXPECT_TRUE(back->lights[0].hidden_from_camera);
  EXPECT_FALSE(back->lights[1].hidden_from_camera);
  EXPECT_EQ(std::get<PointLight>(back->lights[0].kind).radius, 0.25);
  EXPECT_EQ(std::get<DirectionalLight>(back->lights[1].kind).angle_degrees, 0.5);
  EXPECT_EQ(std::get<SpotLight>(back->lights[2].kind).blend, 0.25);
  EXPECT_EQ(std::get<SpotLight>(back->lights[2].kind).radius, 0.125);
  EXPECT_EQ(std::get<SpotLight>(back->lights[2].kind).intensity, std::get<SpotLight>(scene.lights[2].kind).intensity);
  EXPECT_EQ(std::get<IesLight>(back->lights[4].kind).asset, sha256("profile"));
  const auto& sky = std::get<EnvironmentLight>(back->lights[5].kind);
  EXPECT_EQ(sky.asset, sha256("image"));
  EXPECT_TRUE(sky.equal_area);
  EXPECT_EQ(sky.orientation, (std::array{Point3d{0, 1, 0}, Point3d{0, 0, 1}, Point3d{1, 0, 0}}));
  EXPECT_EQ(back->materials[0].emission_unit, EmissionUnit::flux);
  EXPECT_EQ(back->materials[0].emission_exponent, 2);
  EXPECT_FLOAT_EQ(back->materials[0].emission.rgb.g, 5);
}

}  // namespace
}  // namespace lightmill
