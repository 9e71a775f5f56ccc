// Virtual meters of a scene document. Normals and directions need not be unit vectors.
#pragma once

#include <string>
#include <variant>

#include "common/scene/document/values.h"

namespace lightmill {

/// A parallelogram that faces the side of edge1 × edge2.
struct Patch {
  Point3d corner{0, 0, 0};
  Point3d edge1{1, 0, 0}, edge2{0, 1, 0};
};
struct IrradianceMeter {
  Point3d point{0, 0, 0};
  Point3d normal{0, 1, 0};
};
/// The mean irradiance of a patch.
struct PatchMeter {
  Patch patch;
};
struct RadianceMeter {
  Point3d point{0, 0, 0};
  Point3d direction{0, 0, -1};  ///< viewing direction
};
struct FluxMeter {
  Patch patch;
};
struct Meter {
  std::string name;
  std::variant<IrradianceMeter, PatchMeter, RadianceMeter, FluxMeter> kind;
};

/// The patch of a patch meter or flux meter. Null for other meters.
inline const Patch* patch_of(const Meter& meter) {
  if (const auto* mean = std::get_if<PatchMeter>(&meter.kind)) {
    return &mean->patch;
  }
  const auto* flux = std::get_if<FluxMeter>(&meter.kind);
  return flux == nullptr ? nullptr : &flux->patch;
}

}  // namespace lightmill
