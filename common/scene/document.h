// The scene document as plain values: what is to be seen, naming its assets by content.
//
// Mirrors lightmill.v1.Scene (proto/lightmill/v1/scene.proto, the schema); common/wire converts. Lengths are in scene
// units (metres where it matters), angles in degrees, y up is customary but not required.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/document/camera.h"
#include "common/scene/document/light.h"
#include "common/scene/document/material.h"
#include "common/scene/document/meter.h"
#include "common/scene/document/shape.h"

namespace lightmill {

inline constexpr std::size_t kMaxSceneEntries = 1'000'000;  ///< textures, materials, objects and lights, of each
inline constexpr std::size_t kMaxMedia = 65'535;            ///< materials that light passes into

struct Scene {
  std::string name;
  Camera camera;
  FilmSettings film;
  std::vector<TextureImage> textures;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<Light> lights;  ///< at most one environment among them
  std::vector<Meter> meters;  ///< at most kMaxMeters
};

/// The names of the scene's light groups, sorted, each once.
std::vector<std::string> light_groups_of(const Scene& scene);

/// Whether any shape holds a medium that scatters.
bool has_scattering_media(const Scene& scene);
/// Of all materials' interiors; what they scatter stays.
void remove_absorption(Scene& scene);

/// The assets that the scene names, sorted, each once.
std::vector<Sha256> assets_of(const Scene& scene);

}  // namespace lightmill
