// Ray intersection by Embree (or, if asked for, by trying everything). The only folder that includes Embree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/base/status.h"
#include "common/geometry/ray.h"

namespace lightmill {

/// A scene of triangle meshes, their instances, spheres and planes that answers rays. Build once, by one thread, then
/// immutable and thread-safe. Memory that ends while it is built is std::bad_alloc, as elsewhere.
///
/// The hierarchy is built by one thread, so that it, and with it the choice between hits at equal distance, is a
/// function of the geometry alone; Embree's AVX2 code is used on every processor.
class Accel {
 public:
  enum class Kind {
    fast,
    robust,       ///< watertight at edges and exact for far-off geometry, some 8–20 % slower
    brute_force,  ///< without a hierarchy (brute_force.h)
  };
  explicit Accel(Kind kind);
  ~Accel();
  Accel(const Accel&) = delete;
  Accel& operator=(const Accel&) = delete;

  /// Each add gives the next geometry index.
  std::uint32_t add_mesh(std::span<const std::array<float, 3>> positions,
                         std::span<const std::array<std::uint32_t, 3>> triangles);
  std::uint32_t add_sphere(const Vec3& center, float radius);
  /// Without end; `normal` is a unit vector.
  std::uint32_t add_plane(const Vec3& point, const Vec3& normal);
  /// A mesh that is not there itself, but as instances of it. Gives its number among such meshes.
  std::uint32_t add_prototype(std::span<const std::array<float, 3>> positions,
                              std::span<const std::array<std::uint32_t, 3>> triangles);
  /// `to_scene` maps the prototype's coordinates: three rows of four. Hits have the prototype's triangle and a normal
  /// in the prototype's coordinates.
  std::uint32_t add_instance(std::uint32_t prototype, const std::array<std::array<float, 4>, 3>& to_scene);
  /// Builds the hierarchy. INTERNAL if Embree fails.
  Status commit();

  /// Which rays can be traced: those whose origin and direction are finite and below 1.8e18. The others hit nothing.
  static M8 traceable(const Ray8& rays) {
    return in_range(rays.origin) & in_range(rays.direction) & (rays.max_distance >= F8(0.0f));
  }
  /// The nearest hit of each ray in `lanes`. `coherent` says that the rays are nearly parallel or share an origin.
  Hit8 intersect(M8 lanes, const Ray8& rays, bool coherent) const;
  /// Which of `lanes` hit anything.
  M8 occluded(M8 lanes, const Ray8& rays) const;

 private:
  /// What Embree takes: finite, and so small that squares do not overflow (its FLT_LARGE). Beyond that it gives wrong
  /// answers, or aborts where it was built with assertions.
  static M8 in_range(const V8& v) {
    const F8 limit(1.844e18f);
    return (abs(v.x) <= limit) & (abs(v.y) <= limit) & (abs(v.z) <= limit);
  }

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightmill
