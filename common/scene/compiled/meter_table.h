// The virtual meters of a scene in the frame that it is rendered in.
#pragma once

#include <vector>

#include "common/math/vec.h"
#include "common/scene/compiled/medium_table.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"

namespace lightmill {

class MeterSurfaces;

/// Where a meter's estimates begin.
struct MeterPlace {
  bool looks = false;  ///< a ray into `direction`; else a surface that receives light on the side of `direction`
  Vec3 corner{0};      ///< the point, or a parallelogram's corner
  Vec3 edge1{0}, edge2{0};
  Vec3 direction{0};  ///< unit
  Vec3 magnitude{0};  ///< of a meter on a surface, the sizes that entered it: see surface_offset; zero in the open
  Media8 media = {};  ///< that it is in

  /// Its middle, moved as far along `direction` as its estimates begin.
  Vec3 middle() const {
    const float offset = looks ? 0.0f : 0x1p-19f * glm::dot(glm::abs(direction), magnitude);
    return corner + (edge1 + edge2) * 0.5f + direction * offset;
  }
};

using MeterTable = std::vector<MeterPlace>;

MeterTable compile_meters(const std::vector<Meter>& meters, const WorldFrame& frame, const MeterSurfaces& surfaces);

}  // namespace lightmill
