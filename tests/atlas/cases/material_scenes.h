// Scenes of materials, glass and media that the map and other tests share.
#pragma once

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

/// A floor that reflects an emitter of radiance 1, seen at 45°. The emitter fills the reflection of a sharp lobe, and
/// the rest is black.
AtlasCase emitter_in_a_floor(const std::string& kind, double exact);
/// An emitter above a plate of metal (n = 0.2, k = 3.9). A mirror would show the emitter's rim or its inside.
AtlasCase emitter_over_a_plate(double roughness, double radius, double aside);
/// A view between two mirrors at 45°: one reflection for each unit of length up to the emitter at the end.
AtlasCase mirror_corridor(double reflectance, int reflections);

/// Two pieces of glass, `a` (1.5) and `b` (1.3, of higher priority).
struct GlassPair {
  std::string name, objects;
};
inline const char* const kGlassPairMaterials =
    R"({"name": "a", "dielectric": {"ior": 1.5}}, {"name": "b", "dielectric": {"ior": 1.3}, "priority": 1})";
/// Nested pairs, pairs that touch from inside and outside, overlapping pairs, and blocks that overlap by 1e-3.
std::vector<GlassPair> glass_pairs();
/// Meshes that the pairs name. The left block ends at x = reach.
std::map<std::string, std::string> glass_pair_files(double reach);

/// A camera in a rod of glass under a uniform sky. On every path the radiance in glass is n² of that outside. A path of
/// length 20 along the axis, 60° off the walls' normals, meets the walls about 115 times.
AtlasCase light_pipe();
/// A hollow shell. Its outside reflects 4 % of the sky at normal incidence, and no light comes from within.
AtlasCase ink(const std::string& interior);
/// A camera at the middle of a ball of glass. Nothing is totally reflected there: radiance is n² of that outside.
AtlasCase camera_in_glass(double ior);

/// A regular octahedron; `normal` gives the normal of a corner.
std::string octahedron(const std::function<std::array<double, 3>(const std::array<double, 3>&)>& normal);

}  // namespace lightmill::test
