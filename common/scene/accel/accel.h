// Ray intersection by Embree, or without a hierarchy if requested. Only this folder includes Embree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/base/status.h"
#include "common/geometry/ray.h"

namespace lightmill {

/// A scene of triangle meshes, instances, spheres and planes that answers ray queries. One thread builds it. Then it is
/// immutable and thread-safe. Throws std::bad_alloc if memory runs out while it is built.
///
/// One thread builds the hierarchy, so it depends only on the geometry, and so does the choice between hits at equal
/// distance. Embree runs its AVX2 code on every processor.
class Accel {
 public:
  enum class Kind {
    fast,
    robust,       ///< watertight at edges and exact for far-off geometry, about 8–20 % slower
    brute_force,  ///< without a hierarchy (brute_force.h)
  };
  explicit Accel(Kind kind);
  ~Accel();
  Accel(const Accel&) = delete;
  Accel& operator=(const Accel&) = delete;

  /// Each add returns the next geometry index.
  std::uint32_t add_mesh(std::span<const std::array<float, 3>> positions,
                         std::span<const std::array<std::uint32_t, 3>> triangles);
  std::uint32_t add_sphere(const Vec3& center, float radius);
  /// An infinite plane. `normal` is a unit vector.
  std::uint32_t add_plane(const Vec3& point, const Vec3& normal);
  /// A mesh that only appears as its instances. Returns its number among such meshes.
  std::uint32_t add_prototype(std::span<const std::array<float, 3>> positions,
                              std::span<const std::array<std::uint32_t, 3>> triangles);
  /// `to_scene` maps the prototype's coordinates: three rows of four. Hits have the prototype's triangle, and a normal
  /// in the prototype's coordinates.
  std::uint32_t add_instance(std::uint32_t prototype, const std::array<std::array<float, 4>, 3>& to_scene);
  /// Builds the hierarchy. INTERNAL if Embree fails.
  Status commit();

  /// The rays that can be traced: origin and direction are finite and below 1.8e18. Other rays hit nothing.
  static M8 traceable(const Ray8& rays) {
    return in_range(rays.origin) & in_range(rays.direction) & (rays.max_distance >= F8(0.0f));
  }
  /// The nearest hit of each ray in `lanes` beyond `min_distance`. `coherent`: the rays are nearly parallel or share an
  /// origin.
  Hit8 intersect(M8 lanes, const Ray8& rays, bool coherent, F8 min_distance = F8(0.0f)) const;
  /// The rays of `lanes` that hit anything.
  M8 occluded(M8 lanes, const Ray8& rays) const;

 private:
  /// The range of Embree: finite, and squares do not overflow (its FLT_LARGE). Beyond it Embree gives wrong answers, or
  /// aborts if it was built with assertions.
  static M8 in_range(const V8& v) {
    const F8 limit(1.844e18f);
    return (abs(v.x) <= limit) & (abs(v.y) <= limit) & (abs(v.z) <= limit);
  }

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightmill
