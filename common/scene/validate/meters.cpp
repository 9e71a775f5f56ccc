#include "common/scene/validate/parts.h"

#include "common/base/overloaded.h"
#include "common/base/text.h"
#include "common/film/tile_grid.h"

namespace lightmill {
namespace {

Status check_patch(const std::string& path, const Patch& patch) {
  LM_RETURN_IF_ERROR(check_point(path + ".corner", patch.corner));
  LM_RETURN_IF_ERROR(check_direction(path + ".edge1", patch.edge1));
  LM_RETURN_IF_ERROR(check_direction(path + ".edge2", patch.edge2));
  if (const Point3d& b = patch.edge2; are_parallel(patch.edge1, b)) {
    return invalid_argument("{}.edge2: must not be parallel to edge1, got ({}, {}, {})", path, b[0], b[1], b[2]);
  }
  return ok_status();
}

}  // namespace

Status check_meters(const std::vector<Meter>& meters) {
  if (meters.size() > kMaxMeters) {
    return invalid_argument("meters: at most {} are possible, got {}", kMaxMeters, meters.size());
  }
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < meters.size(); ++i) {
    const std::string path = fmt::format("meters[{}]", i);
    const std::string& name = meters[i].name;
    if (name.empty()) {
      return invalid_argument("{}.name: must not be empty", path);
    }
    LM_RETURN_IF_ERROR(check_name(path + ".name", name));
    LM_RETURN_IF_ERROR(check_new_name(names, path, name, "meter"));
    LM_RETURN_IF_ERROR(std::visit(
        Overloaded{[&](const IrradianceMeter& meter) {
                     const Status status = check_point(path + ".irradiance.point", meter.point);
                     return status.ok() ? check_direction(path + ".irradiance.normal", meter.normal) : status;
                   },
                   [&](const PatchMeter& meter) { return check_patch(path + ".patch", meter.patch); },
                   [&](const RadianceMeter& meter) {
                     const Status status = check_point(path + ".radiance.point", meter.point);
                     return status.ok() ? check_direction(path + ".radiance.direction", meter.direction) : status;
                   },
                   [&](const FluxMeter& meter) { return check_patch(path + ".flux.patch", meter.patch); }},
        meters[i].kind));
  }
  return ok_status();
}

}  // namespace lightmill
