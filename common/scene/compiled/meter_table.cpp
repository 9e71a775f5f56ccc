#include "common/scene/compiled/meter_table.h"

#include <cmath>

#include "common/base/overloaded.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/meter_surfaces.h"

namespace lightmill {
namespace {

/// The unit vector of a vector of any length except zero.
Vec3d unit(const Vec3d& v) {
  const Vec3d near_one = v / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return glm::normalize(near_one);
}

}  // namespace

MeterTable compile_meters(const std::vector<Meter>& meters, const WorldFrame& frame, const MeterSurfaces& surfaces) {
  MeterTable table;
  for (const Meter& meter : meters) {
    CompiledMeter compiled;
    Vec3d corner, edge1(0), edge2(0), direction;
    if (const Patch* patch = patch_of(meter)) {
      corner = frame.to_frame(to_vec(patch->corner));
      edge1 = to_vec(patch->edge1) * frame.scale();
      edge2 = to_vec(patch->edge2) * frame.scale();
      direction = unit(glm::cross(unit(edge1), unit(edge2)));
    } else if (const auto* point = std::get_if<IrradianceMeter>(&meter.kind)) {
      corner = frame.to_frame(to_vec(point->point));
      direction = unit(to_vec(point->normal));
    } else {
      const auto& ray = std::get<RadianceMeter>(meter.kind);
      compiled.measures_radiance = true;
      corner = frame.to_frame(to_vec(ray.point));
      direction = unit(to_vec(ray.direction));
    }
    compiled.corner = Vec3(corner);
    compiled.edge1 = Vec3(edge1);
    compiled.edge2 = Vec3(edge2);
    compiled.direction = Vec3(direction);
    if (!compiled.measures_radiance) {
      compiled.magnitude = Vec3(surfaces.magnitude({corner, edge1, edge2}));
    }
    table.push_back(compiled);
  }
  return table;
}

}  // namespace lightmill
