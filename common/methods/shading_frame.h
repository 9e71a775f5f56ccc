// Local frames of surfaces, in which methods evaluate BSDFs, and the rules for normals of normal maps and bump maps.
//
// A mapped normal N differs from the geometric normal G by up to 87 degrees. Two rules keep light that would be lost:
//   - If `wo` is behind N, the BSDF gets its mirror image about the plane of N. So radiance is continuous there.
//   - Light that the BSDF takes from `wi` behind G comes from the mirror image of wi about the plane of G. So no
//     sampled direction is lost, and eval is a sum over both images of a direction.
// The albedo is that of the BSDF, so it is at most 1. N depends on no direction (Cycles tilts it by wo), so light paths
// and camera paths have the same frames and densities, and vcm's weights sum to 1. The BSDF is not reciprocal. Light
// paths scatter by its adjoint (Veach 1997, 5.3), see photon_tracer.h. Microfacet-based normal mapping (Schüssler,
// Heitz, Hanika and Dachsbacher 2017) is not used, because maps of diffuse surfaces do not show in the sun with it.
#pragma once

#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Whether a BSDF can scatter to `wi`: both normals must agree on its side. `side`: cosine to the geometric one.
template <class Bsdf>
M8 scatters_to(const V8& wi, F8 side) {
  const M8 above = (wi.z > F8(0.0f)) & (side > F8(0.0f));
  if constexpr (Bsdf::kTransmits) {
    return above | ((wi.z < F8(0.0f)) & (side < F8(0.0f)));
  } else {
    return above;
  }
}

/// The geometric normal if light reaches the surface only from above, else zero.
template <class Bsdf>
decltype(auto) opaque_normal(const Bsdf& bsdf, const V8& facing) {
  if constexpr (requires { bsdf.transmits(); }) {
    return masked(~bsdf.transmits(), facing);
  } else if constexpr (Bsdf::kTransmits) {
    return V8();
  } else {
    return facing;  // a reference
  }
}

/// The mirror image of a direction about the plane of a unit normal.
inline V8 mirror_image(const V8& direction, const V8& normal) {
  return direction - normal * (F8(2.0f) * dot(direction, normal));
}

struct ShadingFrame8 {
  V8 facing;     ///< the geometric normal on the ray's side
  Frame8 frame;  ///< around the shading normal on the ray's side; its s is the direction of anisotropic surfaces
  M8 mapped;     ///< see Surface8

  explicit ShadingFrame8(const Surface8& surface)
      : facing(select(surface.front, surface.geometric_normal, -surface.geometric_normal)),
        frame(select(surface.front, surface.shading_normal, -surface.shading_normal)),
        mapped(surface.mapped) {
    if (surface.directed.any()) [[unlikely]] {
      frame.turn(surface.tangent, surface.directed);
    }
  }
  /// The same normal for both.
  explicit ShadingFrame8(const V8& normal) : facing(normal), frame(normal) {}

  /// The direction in which light leaves, as BSDFs take it: in the local frame, with a positive z.
  V8 wo(const V8& direction) const {
    V8 out = frame.to_local(direction);
    out.z = select(mapped, max(abs(out.z), F8(kMinCosine)), out.z);
    return out;
  }

  /// Calls `visit(wi, lanes)` for each image of a direction from which the BSDF takes light, in the local frame.
  template <class Bsdf, class Visit>
  void for_each_wi(const V8& direction, M8 lanes, const Visit& visit) const {
    const F8 side = dot(direction, facing);
    V8 wi = frame.to_local(direction);
    for (bool mirrored = false;; mirrored = true) {  // one copy of `visit`
      if (const M8 valid = lanes & scatters_to<Bsdf>(wi, side); valid.any()) {
        visit(wi, valid);
      }
      lanes = lanes & mapped;
      if (mirrored || lanes.none()) {
        return;
      }
      wi = frame.to_local(mirror_image(direction, facing));
    }
  }

  /// Turns sampled directions to the right side of the geometric normal, at mapped normals. Returns the lanes that stay
  /// on the wrong side.
  M8 turn(V8& direction, M8 transmitted) const {
    const F8 side = dot(direction, facing);
    const M8 wrong = select(transmitted, side > F8(0.0f), side < F8(0.0f));  // false where `side` is NaN
    const M8 turned = wrong & mapped;
    if (turned.any()) [[unlikely]] {
      direction = select(turned, mirror_image(direction, facing), direction);
    }
    return and_not(wrong, mapped);
  }

  static constexpr float kMinCosine = 1e-4f;
};

}  // namespace lightmill
