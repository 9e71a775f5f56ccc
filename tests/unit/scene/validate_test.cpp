#include "common/scene/validate/validate.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/error_message.h"

namespace lightmill {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Scene example() {
  Scene scene;
  scene.materials = {{"white", DiffuseMaterial{}, {}, false},
                     {"mirror", MirrorMaterial{}, {}, false},
                     {"glass", DielectricMaterial{}, {}, false}};
  scene.objects = {{"ball", 2, SphereShape{}}, {"mesh", 0, MeshShape{}}};
  scene.lights = {{"bulb", PointLight{{0, 3, 0}, {1, 1, 1}}}};
  return scene;
}

template <class Change>
std::string error_after(const Change& change) {
  Scene scene = example();
  change(scene);
  return test::error_message(validate(scene));
}

TEST(Document, AGoodSceneIsValid) {
  EXPECT_EQ(error_after([](Scene&) {}), "no error");
}

TEST(Document, LongNamesAreRefused) {
  const std::string name(kMaxSceneNameBytes + 1, 'a');
  const std::string error = ".name: 1001 bytes are more than the limit of 1000";
  EXPECT_EQ(error_after([&](Scene& s) { s.name = name; }), "scene" + error);
  EXPECT_EQ(error_after([&](Scene& s) { s.materials[1].name = name; }), "materials[1]" + error);
  EXPECT_EQ(error_after([&](Scene& s) { s.objects[0].name = name; }), "objects[0]" + error);
  EXPECT_EQ(error_after([&](Scene& s) { s.lights[0].name = name; }), "lights[0]" + error);
  EXPECT_EQ(error_after([&](Scene& s) { s.objects[0].name = name.substr(1); }), "no error");
}

TEST(Document, SingularTransformsAreRefused) {
  const auto with = [](const Transform& t) { return error_after([&](Scene& s) { s.objects[1].transform = t; }); };
  const std::string flat = "objects[1].transform: the map is not invertible (a scale of zero, or axes in one plane)";
  EXPECT_EQ(with({{{0.0005, 0, 0, 1}, {0, 0.0005, 0, 2}, {0, 0, 1000, 3}}}), "no error");
  EXPECT_EQ(with({{{0, 1e-20, 0, 0}, {1e-20, 0, 0, 0}, {0, 0, -1e11, 0}}}), "no error");
  EXPECT_EQ(with({{{1, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 1, 0}}}), flat);
  EXPECT_EQ(with({{{1, 2, 3, 0}, {2, 4, 1, 0}, {1, 2, 1, 0}}}), flat);
  EXPECT_EQ(with({{{1e-40, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}), flat);
  EXPECT_EQ(error_after([](Scene& s) {
              s.objects[0].transform = {{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2.1, 0}}};
            }),
            "objects[0].transform: a sphere can be moved, rotated and scaled equally along all axes, not be distorted");
}

TEST(Document, MetersAreChecked) {
  const auto with = [](const Meter& meter) { return error_after([&](Scene& s) { s.meters = {meter}; }); };
  EXPECT_EQ(with({"desk", IrradianceMeter{}}), "no error");
  EXPECT_EQ(with({"desk", FluxMeter{}}), "no error");
  EXPECT_EQ(with({"", IrradianceMeter{}}), "meters[0].name: must not be empty");
  EXPECT_EQ(with({"a", IrradianceMeter{{0, 0, 0}, {0, 0, 0}}}), "meters[0].irradiance.normal: must not be zero");
  EXPECT_EQ(with({"a", RadianceMeter{{0, kNan, 0}, {0, 0, 1}}}),
            "meters[0].radiance.point: coordinates must be finite and at most 1000000000000, got (0, nan, 0)");
  EXPECT_EQ(with({"a", PatchMeter{{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}}}}),
            "meters[0].patch.edge2: must not be parallel to edge1, got (2, 4, 6)");
  EXPECT_EQ(with({"a", FluxMeter{{{0, 0, 0}, {0, 0, 0}, {2, 4, 6}}}}), "meters[0].flux.patch.edge1: must not be zero");
  EXPECT_EQ(error_after([](Scene& s) {
              s.meters = {{"a", IrradianceMeter{}}, {"a", FluxMeter{}}};
            }),
            "meters[1].name: \"a\" names an earlier meter already");
  EXPECT_EQ(error_after([](Scene& s) {
              for (int i = 0; i < 257; ++i) {
                s.meters.push_back({std::to_string(i), IrradianceMeter{}});
              }
            }),
            "meters: at most 256 are possible, got 257");
}

TEST(Document, CamerasAreChecked) {
  EXPECT_EQ(error_after([](Scene& s) { s.camera.eye[1] = kNan; }),
            "camera.eye: coordinates must be finite and at most 1000000000000, got (0, nan, 0)");
  EXPECT_EQ(error_after([](Scene& s) { s.camera.look_at[0] = 1e13; }),
            "camera.look_at: coordinates must be finite and at most 1000000000000, got (10000000000000, 0, -1)");
  EXPECT_EQ(error_after([](Scene& s) { s.camera.look_at = s.camera.eye; }),
            "camera.look_at: must differ from camera.eye, both are (0, 0, 0)");
  EXPECT_EQ(error_after([](Scene& s) { s.camera.up = {0, 0, 0}; }), "camera.up: must not be zero");
  EXPECT_EQ(error_after([](Scene& s) {
              s.camera.up = {0, 0, 2};
            }),
            "camera.up: must not be parallel to the direction from eye to look_at, got (0, 0, 2)");
  for (const double fov : {0.0, 180.0, -1.0, kNan}) {
    EXPECT_EQ(error_after([&](Scene& s) { s.camera.vertical_fov_degrees = fov; }),
              fmt::format("camera.vertical_fov_degrees: must be in (0, 180), got {}", fov));
  }
}

TEST(Document, FilmsAreChecked) {
  EXPECT_EQ(error_after([](Scene& s) { s.film.width = 0; }), "film.width: must be 1 to 65536, got 0");
  EXPECT_EQ(error_after([](Scene& s) { s.film.height = 65537; }), "film.height: must be 1 to 65536, got 65537");
  EXPECT_EQ(error_after([](Scene& s) { s.film.filter.radius_pixels = kInfinity; }),
            "film.filter.radius_pixels: must be in (0, 16], got inf");
}

TEST(Document, MaterialsAreChecked) {
  EXPECT_EQ(error_after([](Scene& s) { s.materials[0].name.clear(); }), "materials[0].name: must not be empty");
  EXPECT_EQ(error_after([](Scene& s) { s.materials[1].name = "white"; }),
            "materials[1].name: \"white\" names an earlier material already");
  EXPECT_EQ(error_after([](Scene& s) {
              s.materials[0].kind = DiffuseMaterial{{0.5f, 1.5f, 0}};
            }),
            "materials[0].diffuse.reflectance: each component must be in [0, 1], got (0.5, 1.5, 0)");
  EXPECT_EQ(error_after([](Scene& s) {
              s.materials[1].kind = MirrorMaterial{{-0.5f, 0, 0}};
            }),
            "materials[1].mirror.reflectance: each component must be in [0, 1], got (-0.5, 0, 0)");
  EXPECT_EQ(error_after([](Scene& s) { s.materials[2].kind = DielectricMaterial{0}; }),
            "materials[2].dielectric.ior: must be in (0, 10], got 0");
  EXPECT_EQ(error_after([](Scene& s) { s.materials[2].emission.rgb.g = -1; }),
            "materials[2].emission: each component must be in [0, 1e+20], got (0, -1, 0)");
}

TEST(Document, ObjectsAndLightsAreChecked) {
  EXPECT_EQ(error_after([](Scene& s) { s.objects.clear(); }),
            "objects: the scene is empty, at least one object is expected");
  EXPECT_EQ(error_after([](Scene& s) { s.objects[1].material = 3; }),
            "objects[1].material: index 3 is out of range, there are 3 materials");
  EXPECT_EQ(error_after([](Scene& s) {
              s.objects[0].shape = SphereShape{{0, 0, 0}, -1, false};
            }),
            "objects[0].sphere.radius: must be positive and at most 1000000000000, got -1");
  EXPECT_EQ(error_after([](Scene& s) {
              s.objects[0].shape = SphereShape{{0, kInfinity, 0}, 1, false};
            }),
            "objects[0].sphere.center: coordinates must be finite and at most 1000000000000, got (0, inf, 0)");
  EXPECT_EQ(error_after([](Scene& s) { std::get<PointLight>(s.lights[0].kind).position[2] = kNan; }),
            "lights[0].point.position: coordinates must be finite and at most 1000000000000, got (0, 3, nan)");
  EXPECT_EQ(error_after([](Scene& s) {
              std::get<PointLight>(s.lights[0].kind).intensity.b = std::numeric_limits<float>::infinity();
            }),
            "lights[0].point.intensity: each component must be in [0, 1e+20], got (1, 1, inf)");
  const auto with_ies = [](const RgbColor& color, double scale) {
    return error_after([&](Scene& s) {
      IesLight ies;
      ies.color = color;
      ies.scale = scale;
      s.lights[0].kind = ies;
    });
  };
  EXPECT_EQ(with_ies({0, 0, 0}, 1), "lights[0].ies.color: must not be black. A scale of 0 turns the light off");
  EXPECT_EQ(with_ies({0, 1e-9f, 0}, 0), "no error");
}

TEST(Document, PlanesCannotEmitAFlux) {
  const auto with = [](EmissionUnit unit, const RgbColor& emission, const auto& shape) {
    return error_after([&](Scene& s) {
      s.materials[1].emission.rgb = emission;
      s.materials[1].emission_unit = unit;
      s.objects[0] = {"floor", 1, shape};
    });
  };
  EXPECT_EQ(
      with(EmissionUnit::flux, {0, 0, 5}, PlaneShape{}),
      "objects[0].plane: its material \"mirror\" states a power (materials[1].emission_flux, or emission_strength in watt "
      "or lumen), which an infinite plane cannot have: give radiance or watts per square metre");
  EXPECT_EQ(with(EmissionUnit::radiance, {0, 0, 5}, PlaneShape{}), "no error");
  EXPECT_EQ(with(EmissionUnit::flux, {0, 0, 0}, PlaneShape{}), "no error");
  EXPECT_EQ(with(EmissionUnit::flux, {0, 0, 5}, SphereShape{}), "no error");
}

}  // namespace
}  // namespace lightmill
