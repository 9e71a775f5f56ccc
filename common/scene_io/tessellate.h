// Meshes of curved surfaces, for files that have shapes which a scene document lacks.
#pragma once

#include <functional>

#include "common/scene/mesh.h"

namespace lightmill {

/// A point of a surface at (u, v) in [0, 1]².
struct PatchPoint {
  std::array<double, 3> position{};
  std::array<double, 3> normal{};  ///< unit
};
using Surface = std::function<PatchPoint(double u, double v)>;

/// `across` × `along` cells of two triangles each. Their geometric normal is on the side of ∂u × ∂v. Texture
/// coordinates are (u, v). Normals are omitted unless `smooth`.
Mesh tessellate(const Surface& surface, std::uint32_t across, std::uint32_t along, bool smooth);

inline constexpr std::uint32_t kCircleSteps = 256;  ///< of a full circle

// The surfaces begin at +x, turn towards +y and end at `degrees`, along u. Their parts have the area of the curved
// ones: radii are slightly larger than 1 at the corners of disks and cylinders.

/// In the plane z = 0, facing +z: v goes from radius 1 to `inner_radius`.
Mesh disk_mesh(double inner_radius, double degrees);
/// Of radius 1 about the z axis, facing outwards: v goes from z = 0 to 1.
Mesh cylinder_mesh(double degrees);
/// Of radius 1, facing outwards: v goes from the height z_low to z_high, in equal steps of latitude.
Mesh sphere_mesh(double z_low, double z_high, double degrees);

}  // namespace lightmill
