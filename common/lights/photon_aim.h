// Aiming light at targets: directions from points, and parallel light through places.
#pragma once

#include <array>
#include <vector>

#include "common/lights/emission_point.h"
#include "common/lights/photon_targets.h"
#include "common/sampling/sobol.h"

namespace lightmill {

/// The densities are those of the whole mixture over the targets: where several are seen in one direction, what is
/// drawn for any of them counts as drawn for all. Immutable once built, thread-safe.
class PhotonAim {
 public:
  PhotonAim() = default;
  /// At most kMostPhotonTargets. `scene` is what parallel light is to cover for an infinite one.
  PhotonAim(std::vector<BoundingSphere> targets, const BoundingSphere& scene);

  std::size_t size() const { return targets_.size(); }
  bool infinite(std::size_t target) const { return targets_[target].all; }

  /// A target drawn for each lane, and with which probability each would have been; their sum is 1.
  struct Choice8 {
    U8 target;
    std::array<F8, kMostPhotonTargets> pmf;
  };

  /// Spheres that light leaves outward; in the lanes where there is one.
  struct Bulbs8 {
    M8 lanes;
    V8 center;
    F8 radius;
  };
  /// Unit normals of such spheres, uniform where some of the chosen target is above the horizon. Each target's
  /// probability is multiplied by how much denser they are for it there than over the whole sphere: so
  /// `direction` gives the density of point and direction times the sphere's area.
  V8 facing(const Bulbs8& bulbs, Choice8& choice, Pair8 u) const;

  struct Direction8 {
    V8 direction;        ///< unit
    F8 pdf_solid_angle;  ///< positive, but 0 where a surface does not emit there
  };
  /// Uniform in the cone that the target fills as seen from the point. From inside of it, and for an infinite one: all
  /// directions, from surfaces by the cosine on the sides that emit.
  Direction8 direction(const EmissionPoint8& from, const Choice8& choice, Pair8 u) const;
  /// With the density for one target alone.
  Direction8 direction_to(std::size_t target, const EmissionPoint8& from, Pair8 u) const;

  /// The density of `direction` drawing this one.
  F8 pdf_solid_angle(const EmissionPoint8& from, const Choice8& choice, const V8& direction) const;

  struct Place8 {
    V8 point;
    F8 pdf_area;  ///< per area across the direction; positive
  };
  /// Uniform on the disc across unit directions that is the target's shadow.
  Place8 place(const V8& direction, const Choice8& choice, Pair8 u) const;
  /// The density of `place` drawing a point with the same shadow.
  F8 pdf_area(const V8& point, const V8& direction, const Choice8& choice) const;
  /// The area of that disc.
  double shadow(std::size_t target) const;

 private:
  struct Target {
    Vec3 center;
    float radius;
    bool all;  ///< infinite: then center and radius are the scene's
  };
  /// How a target looks from a point.
  struct Cone8 {
    V8 axis;
    F8 one_minus_cos;  ///< of its half angle
    M8 all;            ///< it is all around
  };
  Cone8 cone(const Target& target, const V8& p) const;
  /// The normals that face a target.
  struct Cap8 {
    V8 axis;
    F8 one_minus_cos;
  };
  static Cap8 cap(const Target& target, const Bulbs8& bulbs);
  static V8 draw(const Cone8& cone, const EmissionPoint8& from, Pair8 u);
  static F8 density(const Cone8& cone, M8 inside, const EmissionPoint8& from, const V8& direction);

  std::vector<Target> targets_;
};

}  // namespace lightmill
