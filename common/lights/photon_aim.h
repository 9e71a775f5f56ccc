// Directions from points to targets, and positions of parallel light that hits targets.
#pragma once

#include <array>
#include <vector>

#include "common/lights/light_sample.h"
#include "common/lights/photon_targets.h"
#include "common/sampling/sobol.h"

namespace lightmill {

/// Densities are those of the mixture over all targets: if several targets lie in one direction, it counts for all of
/// them. Immutable once built, thread-safe.
class PhotonAim {
 public:
  PhotonAim() = default;
  /// At most kMaxPhotonTargets targets. `scene`: the sphere that parallel light covers for an infinite target.
  PhotonAim(std::vector<BoundingSphere> targets, const BoundingSphere& scene);

  std::size_t size() const { return targets_.size(); }
  bool infinite(std::size_t target) const { return targets_[target].all; }

  /// A target drawn for each lane, and the probabilities of all targets. They sum to 1.
  struct Choice8 {
    U8 target;
    std::array<F8, kMaxPhotonTargets> pmf;
  };

  /// Spheres that shine outward, in some lanes.
  struct LightSpheres8 {
    M8 lanes;
    V8 center;
    F8 radius;
  };
  /// Samples unit normals of such spheres, uniform where some of the chosen target is above the horizon. Each target's
  /// probability is multiplied by the ratio of its density there to the density over the whole sphere. So `direction`
  /// returns the density of point and direction, times the sphere's area.
  V8 facing(const LightSpheres8& spheres, Choice8& choice, Pair8 u) const;

  struct Direction8 {
    V8 direction;        ///< unit
    F8 pdf_solid_angle;  ///< positive; 0 where a surface does not emit
  };
  /// Uniform in the cone that the target subtends at the point. From inside a target, and for an infinite one, it
  /// samples all directions. From surfaces, these are cosine-distributed on the emitting sides.
  Direction8 direction(const EmissionPoint8& from, const Choice8& choice, Pair8 u) const;
  /// The same for one target, with its own density.
  Direction8 direction_to(std::size_t target, const EmissionPoint8& from, Pair8 u) const;

  /// Density of `direction` returning this direction.
  F8 pdf_solid_angle(const EmissionPoint8& from, const Choice8& choice, const V8& direction) const;

  struct Place8 {
    V8 point;
    F8 pdf_area;  ///< per area across the direction; positive
  };
  /// Uniform on the target's projection along the direction, which is a disk.
  Place8 place(const V8& direction, const Choice8& choice, Pair8 u) const;
  /// Density of `place` returning a point with the same projection.
  F8 pdf_area(const V8& point, const V8& direction, const Choice8& choice) const;
  /// Area of this disk.
  double projected_area(std::size_t target) const;

 private:
  struct Target {
    Vec3 center;
    float radius;
    bool all;  ///< infinite; center and radius are then the scene's
  };
  /// A target as seen from a point.
  struct Cone8 {
    V8 axis;
    F8 one_minus_cos;  ///< of the half angle
    M8 all;            ///< the target surrounds the point
  };
  Cone8 cone(const Target& target, const V8& p) const;
  /// Normals that face a target.
  struct Cap8 {
    V8 axis;
    F8 one_minus_cos;
  };
  static Cap8 cap(const Target& target, const LightSpheres8& spheres);
  static V8 draw(const Cone8& cone, const EmissionPoint8& from, Pair8 u);
  static F8 density(const Cone8& cone, M8 inside, const EmissionPoint8& from, const V8& direction);

  std::vector<Target> targets_;
};

}  // namespace lightmill
