// The virtual meters of a scene, in the frame.
#pragma once

#include <vector>

#include "common/math/vec.h"
#include "common/scene/compiled/medium_table.h"
#include "common/scene/compiled/transform.h"

namespace lightmill {

struct ObjectMeshes;

/// The place where a meter's estimates begin.
struct CompiledMeter {
  /// A ray along `direction`; else a surface that receives light on the side of `direction`.
  bool measures_radiance = false;
  Vec3 corner{0};  ///< the point, or a parallelogram's corner
  Vec3 edge1{0}, edge2{0};
  Vec3 direction{0};  ///< unit
  Vec3 magnitude{0};  ///< of a meter on a surface, see surface_offset; else zero
  Media8 media = {};  ///< the media around it

  /// Its middle, moved along `direction` to where its estimates begin.
  Vec3 middle() const {
    const float offset = measures_radiance ? 0.0f : 0x1p-19f * glm::dot(glm::abs(direction), magnitude);
    return corner + (edge1 + edge2) * 0.5f + direction * offset;
  }
};

using MeterTable = std::vector<CompiledMeter>;

/// `maps` and `bounds` (in scene units): one per object.
MeterTable compile_meters(const Scene& scene, const ObjectMeshes& meshes, const std::vector<Affine>& maps,
                          const std::vector<Bounds>& bounds, const WorldFrame& frame);

}  // namespace lightmill
