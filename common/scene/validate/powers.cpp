#include "common/scene/validate/parts.h"

#include <algorithm>

#include "common/base/text.h"
#include "common/scene/mesh.h"

namespace lightmill {
namespace {

bool has_area(const Point3d& a, const Point3d& b, const Point3d& c) {
  const Point3d u = difference(b, a), v = difference(c, a);
  return u[1] * v[2] != u[2] * v[1] || u[2] * v[0] != u[0] * v[2] || u[0] * v[1] != u[1] * v[0];
}

/// In the shape's own coordinates, because an invertible transform keeps an area above zero.
Result<bool> has_area(const Object& object, const SceneAssets& assets) {
  if (const auto* triangle = std::get_if<TriangleShape>(&object.shape)) {
    return has_area(triangle->a, triangle->b, triangle->c);
  }
  if (const auto* shape = std::get_if<MeshShape>(&object.shape)) {
    LM_ASSIGN_OR_RETURN(const Mesh mesh, decode_mesh(as_byte_view(assets.at(shape->asset))));
    return std::ranges::any_of(mesh.triangles, [&](const std::array<std::uint32_t, 3>& t) {
      return has_area(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
    });
  }
  return true;
}

}  // namespace

Status check_powers(const Scene& scene, const SceneAssets& assets) {
  std::map<std::uint32_t, bool> radiates;  ///< by material with a power: whether one of its surfaces has an area
  for (const Object& object : scene.objects) {
    const Material& material = scene.materials[object.material];
    if (material.emission_unit == EmissionUnit::flux && material.emission != TexturedColor{} &&
        !radiates[object.material]) {
      LM_ASSIGN_OR_RETURN(radiates[object.material], has_area(object, assets));
    }
  }
  for (const auto& [index, any] : radiates) {
    if (!any) {
      return invalid_argument(
          "materials[{}]: \"{}\" states a power (emission_flux, or emission_strength in watt or lumen), but "
          "its surfaces have no area",
          index, printable(scene.materials[index].name));
    }
  }
  return ok_status();
}

}  // namespace lightmill
