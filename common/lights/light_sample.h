// Results of light sampling, start points of light paths, and helpers that all lights share.
#pragma once

#include <vector>

#include "common/math/vec.h"
#include "common/sampling/warp.h"

namespace lightmill {

/// A sampled point of a light, seen from a shading point. Each light samples as if it were the only one.
struct LightSample8 {
  V8 point;            ///< slightly off the light's surface; for distant light, kFarAway off
  V8 wi;               ///< unit direction to it
  V8 weight;           ///< radiance over pdf_solid_angle; for delta lights, the irradiance on a surface that faces them
  F8 pdf_solid_angle;  ///< 0 for delta lights, which no ray can hit
  M8 valid;            ///< light comes from there
  U8 light = U8(0u);   ///< its number; set by LightTable
};

/// `lanes` of a, else b.
inline LightSample8 merge(M8 lanes, const LightSample8& a, const LightSample8& b) {
  return {select(lanes, a.point, b.point),
          select(lanes, a.wi, b.wi),
          select(lanes, a.weight, b.weight),
          select(lanes, a.pdf_solid_angle, b.pdf_solid_angle),
          (a.valid & lanes) | and_not(b.valid, lanes),
          U8(0u)};
}

/// A point on an emissive surface, or the position of a light without extent. Then only `point` has a meaning.
struct EmissionPoint8 {
  V8 point;
  V8 normal;     ///< unit, to the emitting side; to either side if both emit
  F8 offset;     ///< along the normal, so that a ray does not hit the surface again
  F8 area;       ///< 1 / pdf_area
  V8 texture;    ///< factor of the surface's radiance
  M8 surface;    ///< false for lights without extent
  M8 two_sided;  ///< light leaves both sides
};

/// `lanes` of a, else b.
inline EmissionPoint8 merge(M8 lanes, const EmissionPoint8& a, const EmissionPoint8& b) {
  return {select(lanes, a.point, b.point),        select(lanes, a.normal, b.normal),
          select(lanes, a.offset, b.offset),      select(lanes, a.area, b.area),
          select(lanes, a.texture, b.texture),    select(lanes, a.surface, b.surface),
          select(lanes, a.two_sided, b.two_sided)};
}

/// Distance at which shadow rays to distant lights end. It lies beyond any scene, whose bounded shapes lie within 2^21.
/// Products of three such lengths stay finite.
inline constexpr float kFarAway = 0x1p40f;

/// Distance to move a point off a surface with unit normal `n`, so that a ray from it cannot hit the surface again.
/// Each coordinate has a few rounding errors of `magnitude`, which are the sizes that entered it (positions, the ray's
/// length, the triangle's extent). Only their part along the normal matters.
inline F8 surface_offset(const V8& n, const V8& magnitude) {
  return F8(0x1p-19f) * (abs(n.x) * magnitude.x + abs(n.y) * magnitude.y + abs(n.z) * magnitude.z);
}

/// Bounds of a light for the choice among many: position, directions and power.
struct LightBounds {
  Vec3d low{0}, high{0};
  Vec3d axis{0, 0, 1};       ///< unit
  double cos_normals = -1;   ///< cosine of the cone about the axis that contains all normals
  double cos_emission = -1;  ///< cosine of the largest angle to a normal with emission
  bool two_sided = false;    ///< also about −axis
  double power = 0;          ///< luminance of the flux
  double intensity = 0;      ///< luminance of the largest intensity in any direction
};

/// Bounds of an infinitely distant light for the choice among many.
struct DistantBounds {
  double irradiance = 0;      ///< luminance, on a surface that faces it
  Vec3d direction{0, 0, 1};   ///< unit, to the light
  double radius = kAnywhere;  ///< of the light on the unit sphere: the sine of its angle
  static constexpr double kAnywhere = 2;
};

/// The lanes of eight vectors one by one, for formulas with branches.
struct VectorLanes {
  alignas(32) float x[8], y[8], z[8];
  explicit VectorLanes(const V8& v) {
    v.x.store(x);
    v.y.store(y);
    v.z.store(z);
  }
  Vec3d operator[](int lane) const { return {x[lane], y[lane], z[lane]}; }
};

/// rows[index] in the lanes of the mask, 0 elsewhere. A single row, as of a scene's only light, is not gathered.
inline F8 gather_row(const std::vector<float>& rows, U8 index, M8 lanes) {
  return rows.size() == 1 ? masked(lanes, F8(rows[0])) : gather(rows.data(), index, lanes);
}

/// A growing array of vectors, gathered by row.
class VectorRows {
 public:
  void add(const Vec3& v) { values_.insert(values_.end(), {v.x, v.y, v.z}); }
  void set(std::size_t row, const Vec3& v) {
    values_[3 * row] = v.x;
    values_[3 * row + 1] = v.y;
    values_[3 * row + 2] = v.z;
  }
  V8 at(U8 row, M8 lanes) const {
    return size() == 1 ? masked(lanes, broadcast((*this)[0])) : gather3(values_.data(), row, lanes);
  }
  Vec3 operator[](std::size_t row) const { return {values_[3 * row], values_[3 * row + 1], values_[3 * row + 2]}; }
  std::size_t size() const { return values_.size() / 3; }

 private:
  std::vector<float> values_;
};

}  // namespace lightmill
