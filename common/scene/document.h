// The scene document as plain values. It names its assets by content.
//
// It mirrors lightmill.v1.Scene (proto/lightmill/v1/scene.proto, the schema). common/wire converts. Lengths are in
// scene units (metres if it matters), angles in degrees. y up is customary but not required.
#pragma once

#include <string>
#include <vector>

#include "common/scene/document/camera.h"
#include "common/scene/document/light.h"
#include "common/scene/document/material.h"
#include "common/scene/document/meter.h"
#include "common/scene/document/shape.h"

namespace lightmill {

inline constexpr std::size_t kMaxSceneNameBytes =
    1000;  ///< of each name: of textures, materials, objects, lights, meters
inline constexpr std::size_t kMaxSceneEntries = 1'000'000;  ///< of textures, materials, objects or lights
inline constexpr std::size_t kMaxMedia = 65'535;            ///< materials that transmit light

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

/// Whether any medium scatters.
bool has_scattering_media(const Scene& scene);
/// Removes the absorption of all media. Scattering stays.
void remove_absorption(Scene& scene);

}  // namespace lightmill
