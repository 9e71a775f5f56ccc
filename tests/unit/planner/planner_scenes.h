// Small scenes of chosen materials and lights, for the planner's tests.
#pragma once

#include <gtest/gtest.h>

#include "common/planner/method_plan.h"
#include "common/scene/validate/validate.h"

namespace lightmill {

inline Material material(const std::string& name, auto kind) {
  Material made;
  made.name = name;
  made.kind = kind;
  return made;
}

/// A scene of spheres side by side, one for each material, under these lights.
inline Scene scene_of(std::vector<Material> materials, std::vector<Light> lights) {
  Scene scene;
  for (std::uint32_t i = 0; i < materials.size(); ++i) {
    scene.objects.push_back({materials[i].name + " ball", i, SphereShape{{3.0 * i, 0, 0}, 1}});
  }
  scene.materials = std::move(materials);
  scene.lights = std::move(lights);
  EXPECT_TRUE(validate(scene).ok()) << validate(scene);
  return scene;
}

inline const Light kBulb{"bulb", PointLight{{0, 5, 0}, {1, 1, 1}}};
inline const Light kSun{"sun", DirectionalLight{{0, -1, 0}, {1, 1, 1}}};
inline const Light kSky{"sky", EnvironmentLight{}};
inline const Material kWhite = material("white", DiffuseMaterial{});
inline const Material kGray = material("gray", DiffuseMaterial{{0.5f, 0.5f, 0.5f}});
inline const Material kBlack = material("black", DiffuseMaterial{{0, 0, 0}});
inline const Material kMirror = material("mirror", MirrorMaterial{});
inline const Material kGlass = material("glass", DielectricMaterial{});

inline Material emitter() {
  Material made = material("lamp", DiffuseMaterial{});
  made.emission = {1, 1, 1};
  return made;
}
inline Material rough_glass(double roughness) {
  return material("frosted", DielectricMaterial{1.5, roughness});
}
inline Material metal(double roughness) {
  return material("metal", ConductorMaterial{{0.2f, 0.9f, 1.1f}, {3.9f, 2.4f, 2.2f}, roughness});
}
inline Material lacquer(double roughness) {
  PrincipledMaterial made;
  made.roughness = roughness;
  return material("lacquer", made);
}

inline Material phong(float diffuse, double exponent) {
  return material("gloss", PhongMaterial{{diffuse, diffuse, diffuse}, {0.4f, 0.4f, 0.4f}, exponent});
}

inline bool path_finds_all(std::vector<Material> materials, std::vector<Light> lights) {
  return admit(read_facts(scene_of(std::move(materials), std::move(lights))), "path").admitted;
}

}  // namespace lightmill
