// What fills closed shapes: the media of a scene, and which of them a path is in.
//
// Shapes may be nested, touch or overlap: where several are, the medium of the highest priority is there, of equals the
// one that was entered last. Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced Images".
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/exp_log.h"
#include "common/math/vec.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"

namespace lightmill {

/// The media that eight paths are in: up to four of 16 bits each, those entered first in the low bits; 0 is none. All
/// bits are set of a path that has entered more: where it is, is not known any more.
struct Media8 {
  U8 low, high;
};
inline Media8 select(M8 mask, const Media8& yes, const Media8& no) {
  return {select(mask, yes.low, no.low), select(mask, yes.high, no.high)};
}

/// What crossing a surface means.
struct Crossing8 {
  F8 eta;         ///< index of refraction beyond the surface over that on the ray's side
  Media8 beyond;  ///< the media there
  M8 real;        ///< light notices: there is a change of medium, and of index unless it is more than a dielectric
};

/// One medium for each material that light passes into, from 1; 0 is the empty space outside of all.
class MediumTable {
 public:
  static constexpr int kMaxDepth = 4;  ///< that are kept of a path

  MediumTable() = default;
  /// `length_scale`: of the frame to render in over scene units.
  MediumTable(const Scene& scene, double length_scale);

  /// Of a material, 0 if it has none.
  U8 of_material(U8 material, M8 lanes) const { return gather(of_material_.data(), material, lanes); }

  /// The one of the media that is where they all are.
  U8 current(const Media8& media) const;
  /// Of a ray that meets the boundary of `medium` (not 0) from outside or from inside.
  Crossing8 cross(const Media8& media, U8 medium, M8 from_outside) const;

  /// Absorption and scattering together.
  V8 extinction(U8 medium) const { return gather3(extinction_.data(), medium, M8(true)); }
  /// Whether any medium scatters; what it scatters per length, and the mean cosine of that.
  bool scatters() const { return scatters_; }
  V8 scattering(U8 medium) const { return gather3(scattering_.data(), medium, M8(true)); }
  F8 anisotropy(U8 medium) const { return gather(anisotropy_.data(), medium, M8(true)); }

  /// Bouguer's law along a way; lengths may be infinite.
  static V8 transmittance(const V8& extinction, F8 length) {
    // 0 · ∞ is 0 here.
    const auto along = [&](F8 s) { return exp(-masked(s > F8(0.0f), s * length)); };
    return {along(extinction.x), along(extinction.y), along(extinction.z)};
  }
  V8 transmittance(U8 medium, F8 length) const { return transmittance(extinction(medium), length); }

  /// Which paths are in more media than are kept. That stays so, whatever they cross; no medium is known to be there.
  static M8 overfull(const Media8& media) { return media.high == U8(0xffffffffu); }

  static Media8 entered(const Media8& media, U8 medium);
  static Media8 left(const Media8& media, U8 medium);

 private:
  std::vector<std::uint32_t> of_material_;
  // One entry a medium (3 for colours); the first is the outside.
  std::vector<std::uint32_t> priority_;  ///< as signed integers
  std::vector<float> ior_, extinction_, scattering_, anisotropy_;
  bool scatters_ = false;
  std::vector<std::uint32_t> plain_;  ///< 1: of a dielectric, whose boundary is nothing but a change of index
};

/// Whether paths must know which media they are in: where something absorbs, has a priority or the index of the
/// outside, or shapes that light passes into may overlap. Else each boundary is one between its medium and the outside,
/// and light notices it.
bool needs_media(const Scene& scene, const std::vector<Bounds>& object_bounds);

}  // namespace lightmill
