// Vectors: glm's for single values, and vectors of eight lanes for the renderer.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "common/math/simd.h"

namespace lightmill {

using Vec3 = glm::vec3;
using Vec3d = glm::dvec3;

/// 8 vectors or 8 RGB values.
struct V8 {
  F8 x, y, z;
};
inline V8 broadcast(const Vec3& a) {
  return {a.x, a.y, a.z};
}
inline V8 operator+(const V8& a, const V8& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline V8 operator-(const V8& a, const V8& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline V8 operator*(const V8& a, const V8& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
inline V8 operator*(const V8& a, F8 s) {
  return {a.x * s, a.y * s, a.z * s};
}
inline V8 operator-(const V8& a) {
  return {-a.x, -a.y, -a.z};
}
inline F8 dot(const V8& a, const V8& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline V8 cross(const V8& a, const V8& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline F8 length_squared(const V8& a) {
  return dot(a, a);
}
inline V8 abs(const V8& a) {
  return {abs(a.x), abs(a.y), abs(a.z)};
}
inline V8 normalize(const V8& a) {
  return a * (F8(1.0f) / sqrt(length_squared(a)));
}
inline F8 max_component(const V8& a) {
  return max(a.x, max(a.y, a.z));
}
inline V8 select(M8 mask, const V8& yes, const V8& no) {
  return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}
inline V8 masked(M8 mask, const V8& a) {
  return {masked(mask, a.x), masked(mask, a.y), masked(mask, a.z)};
}
/// base[3·index + 0, 1, 2] in the lanes of the mask, 0 in the others.
inline V8 gather3(const float* base, U8 index, M8 mask) {
  const U8 first = index + index + index;
  return {gather(base, first, mask), gather(base + 1, first, mask), gather(base + 2, first, mask)};
}

/// Like gather3, for rows of four floats. Reads the first three of each. It is several times as fast as gather3.
inline V8 gather_rows_of_four(const float* base, U8 row, M8 mask) {
  alignas(32) std::uint32_t rows[8];
  masked(mask, row).store(rows);
  const auto rows_of = [&](int low, int high) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(base + 4 * std::size_t{rows[low]})),
                                _mm_loadu_ps(base + 4 * std::size_t{rows[high]}), 1);
  };
  const __m256 a = rows_of(0, 4), b = rows_of(1, 5), c = rows_of(2, 6), d = rows_of(3, 7);
  const __m256 xy_ab = _mm256_unpacklo_ps(a, b), z_ab = _mm256_unpackhi_ps(a, b);
  const __m256 xy_cd = _mm256_unpacklo_ps(c, d), z_cd = _mm256_unpackhi_ps(c, d);
  return masked(mask, V8{F8(_mm256_shuffle_ps(xy_ab, xy_cd, 0x44)), F8(_mm256_shuffle_ps(xy_ab, xy_cd, 0xee)),
                         F8(_mm256_shuffle_ps(z_ab, z_cd, 0x44))});
}

/// An orthonormal frame around each unit normal: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
struct Frame8 {
  V8 s, t, n;
  explicit Frame8(const V8& normal) : n(normal) {
    const F8 sign = copysign(F8(1.0f), n.z);
    const F8 a = F8(-1.0f) / (sign + n.z);
    const F8 b = n.x * n.y * a;
    s = {F8(1.0f) + sign * n.x * n.x * a, sign * b, -(sign * n.x)};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  /// Turns the frame about its normal in these lanes, so that s is `tangent`: a unit vector, perpendicular to n.
  void turn(const V8& tangent, M8 lanes) {
    s = select(lanes, tangent, s);
    t = select(lanes, cross(n, tangent), t);
  }
  V8 to_world(const V8& local) const { return s * local.x + t * local.y + n * local.z; }
  V8 to_local(const V8& world) const { return {dot(s, world), dot(t, world), dot(n, world)}; }
};

}  // namespace lightmill
