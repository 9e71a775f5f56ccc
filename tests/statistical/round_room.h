// A room where methods that gather photons have very little blur.
#pragma once

#include "tests/statistical/same_picture.h"

namespace lightmill::test {

inline const char* const kPoint = R"({"point": {"position": [0, 1.6, 0], "intensity": {"rgb": [4, 4, 4]}}})";

/// A light and a ball of each material in a round room. Nothing touches, so there are no edges for gathering to blur.
inline TestScene round_room(const std::string& lights, const std::string& more_materials = "",
                            const std::string& more_objects = "") {
  return TestScene::from_text(document(
      R"("eye": [0, 0.3, 2.6], "look_at": [0, -0.1, 0])", 60, kFilm,
      diffuse("room", 0.6) + also(named("glass", R"("dielectric": {"ior": 1.5})")) +
          also(named("mirror", R"("mirror": {"reflectance": {"rgb": [0.9, 0.8, 0.7]}})")) +
          also(named("matt", R"("diffuse": {"reflectance": {"rgb": [0.7, 0.3, 0.2]}})")) + more_materials,
      sphere("room", "[0, 0, 0]", 3, true) + also(sphere("glass", "[-0.9, -0.4, 0]", 0.6)) +
          also(sphere("mirror", "[0.9, -0.4, 0]", 0.6)) + also(sphere("matt", "[0, -1.3, 0.5]", 0.4)) + more_objects,
      lights));
}

/// The same room with an absorbing ball, lit by a point and a spot.
inline TestScene amber_under_point_and_spot() {
  const std::string materials =
      also(named("amber", R"("dielectric": {"ior": 1.4}, "interior": {"absorption": {"rgb": [0.2, 1, 3]}})"));
  const std::string lights =
      std::string(kPoint) +
      also(R"({"spot": {"position": [1.5, 1.5, 1], "direction": [-1, -1, -1], "intensity": {"rgb": [5, 2, 2]},
               "cutoff_degrees": 30, "blend": 0.2}})");
  return round_room(lights, materials, also(sphere("amber", "[-0.2, 0.5, 0.3]", 0.5)));
}

}  // namespace lightmill::test
