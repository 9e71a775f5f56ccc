// Scenes of materials, glass and media that both the map and tests of their own look at.
#pragma once

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

/// A floor of this kind that mirrors a lamp of radiance 1, seen at 45°; the lamp fills what a sharp lobe sees and
/// leaves the rest black.
AtlasCase lamp_in_a_floor(const std::string& kind, double exact);
/// A lamp above a plate of metal (n = 0.2, k = 3.9), where a mirror would show its rim or something in it.
AtlasCase lamp_over_a_plate(double roughness, double radius, double aside);
/// Between two mirrors at 45°: one reflection for each unit of the way to the lamp at its end.
AtlasCase mirror_corridor(double reflectance, int reflections);

/// Two pieces of glass, `a` (1.5) and `b` (1.3, of higher priority).
struct GlassPair {
  std::string name, objects;
};
inline const char* const kGlassPairMaterials =
    R"({"name": "a", "dielectric": {"ior": 1.5}}, {"name": "b", "dielectric": {"ior": 1.3}, "priority": 1})";
/// Nested, touching from within and without, overlapping, and blocks that reach a hair (1e-3) into each other.
std::vector<GlassPair> glass_pairs();
/// Meshes that they name; the left block ends at x = reach.
std::map<std::string, std::string> glass_pair_files(double reach);

/// The eye is in a rod of glass under a uniform sky: whatever way light takes, radiance in glass is n² of that outside.
/// Along its axis, 60° off the walls' normals, a path of length 20 meets them some 115 times.
AtlasCase light_pipe();
/// A hollow shell whose outside mirrors the sky by Fresnel: at normal incidence 4 % and nothing from within.
AtlasCase ink(const std::string& interior);
/// At the middle of a ball of glass no light is reflected totally: radiance is n² of that outside.
AtlasCase eye_in_glass(double ior);

/// A regular octahedron; `normal` gives the normal of a corner.
std::string octahedron(const std::function<std::array<double, 3>(const std::array<double, 3>&)>& normal);

}  // namespace lightmill::test
