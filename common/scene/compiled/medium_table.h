// The media of a scene, which fill closed shapes, and the media that a path is in.
//
// Shapes may be nested, touch or overlap. Where several are, the medium with the highest priority applies. With equal
// priorities it is the one that was entered last. Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced
// Images".
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/exp_log.h"
#include "common/math/vec.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"

namespace lightmill {

/// The media that eight paths are in: up to four of 16 bits each. Those entered first are in the low bits. 0 is none.
/// All bits are set if a path has entered more. Then its media are unknown.
struct Media8 {
  U8 low, high;
};
inline Media8 select(M8 mask, const Media8& yes, const Media8& no) {
  return {select(mask, yes.low, no.low), select(mask, yes.high, no.high)};
}

/// The effect of crossing a surface.
struct Crossing8 {
  F8 eta;         ///< index of refraction beyond the surface over that on the ray's side
  Media8 beyond;  ///< the media beyond the surface
  /// The surface affects light. False if the medium does not change, or a dielectric has equal indices on both sides.
  M8 real;
};

/// One medium, from number 1, for each material that light passes into (is_boundary). 0 is the empty space outside.
class MediumTable {
 public:
  static constexpr int kMaxDepth = 4;  ///< media kept per path

  MediumTable() = default;
  /// `length_scale`: of the frame over scene units.
  MediumTable(const Scene& scene, double length_scale);

  /// The medium of a material. 0 if it has none.
  U8 of_material(U8 material, M8 lanes) const { return gather(of_material_.data(), material, lanes); }

  /// The medium with the highest priority, the one that applies.
  U8 current(const Media8& media) const;
  /// The crossing of a ray that meets the boundary of `medium` from outside or inside. 0 is a surface without a medium.
  Crossing8 cross(const Media8& media, U8 medium, M8 from_outside) const;

  /// Absorption plus scattering, per length.
  V8 extinction(U8 medium) const { return gather3(extinction_.data(), medium, M8(true)); }
  /// Whether any medium scatters.
  bool scatters() const { return scatters_; }
  /// Per length.
  V8 scattering(U8 medium) const { return gather3(scattering_.data(), medium, M8(true)); }
  /// Mean cosine of scattering.
  F8 anisotropy(U8 medium) const { return gather(anisotropy_.data(), medium, M8(true)); }

  /// Bouguer's law along a path. Lengths may be infinite.
  static V8 transmittance(const V8& extinction, F8 length) {
    // 0 · ∞ must be 0 here.
    const auto along = [&](F8 s) { return exp(-masked(s > F8(0.0f), s * length)); };
    return {along(extinction.x), along(extinction.y), along(extinction.z)};
  }
  V8 transmittance(U8 medium, F8 length) const { return transmittance(extinction(medium), length); }

  /// The paths that are in more media than are kept. They stay so whatever they cross, and count as outside all media.
  static M8 overfull(const Media8& media) { return media.high == U8(0xffffffffu); }

  static Media8 entered(const Media8& media, U8 medium);
  static Media8 left(const Media8& media, U8 medium);

 private:
  std::vector<std::uint32_t> of_material_;
  // One entry per medium (3 for colours). The first is the outside.
  std::vector<std::uint32_t> priority_;  ///< as signed integers
  std::vector<float> ior_, extinction_, scattering_, anisotropy_;
  bool scatters_ = false;
  std::vector<std::uint32_t> plain_;  ///< 1 for dielectrics: their boundaries only change the index
};

/// Whether paths must know which media they are in. A medium that absorbs, scatters, has a priority or the index of the
/// outside requires it. So do shapes that transmit light and may overlap. Else each boundary is between its medium and
/// the outside, and always affects light.
bool needs_media(const Scene& scene, const std::vector<Bounds>& object_bounds);

}  // namespace lightmill
