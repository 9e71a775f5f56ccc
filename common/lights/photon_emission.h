// Where photons start: light is followed from all lights of a table towards what it is aimed at.
#pragma once

#include <span>
#include <vector>

#include "common/lights/light_emission.h"
#include "common/lights/photon_fluxes.h"
#include "common/sampling/discrete.h"

namespace lightmill {

/// Draws rays along which light leaves the lights. Immutable once built, thread-safe; bits are a function of what it
/// was built from and of the numbers drawn with.
///
/// A light is chosen by an estimate of what it sends to the targets, and one of the targets by the same; then, of a
/// surface, a point uniform by area, of a sphere that shines outward only where some of the target is above the
/// horizon, and a direction in the cone that the target fills as seen from there; of light from infinitely far, a
/// direction, and a place on the target's shadow across it. Densities are those of the mixture over all targets, so
/// where they overlap nothing counts twice. An infinite target is met in all directions; of light from infinitely far,
/// in the shadow of the scene's sphere alone: what reaches the view from farther off, by way of planes without end, is
/// not found.
class PhotonEmission {
 public:
  /// `lights` must live as long. `scene` is a sphere around all that is bounded, and around the eye. `planes` are all
  /// that there are: light from infinitely far starts beyond them. An environment that the table does not sample emits
  /// where `unsampled` light is wanted.
  PhotonEmission(const LightTable& lights, std::span<const BoundingSphere> targets,
                 std::span<const BoundlessPlane> planes, const BoundingSphere& scene, bool unsampled = true);

  /// Nothing to emit: there is no target, or no light that can reach one.
  bool empty() const { return lights_.empty(); }

  struct Photon8 {
    V8 origin;     ///< off the surface that emits; of light from infinitely far, beyond all that is in its way
    V8 direction;  ///< unit
    /// W in each channel. Let f be anything along a ray: the mean of power · f over photons, those that are not valid
    /// as 0, is the integral of f over all light that leaves the lights towards at least one target.
    V8 power;
    /// Its number in the table; of the environment `first(LightKind::environment)`, also where the table does not
    /// sample it.
    U8 light;
    M8 valid;   ///< else there is no light: a point's dark side, a texel that is black
    F8 cosine;  ///< of the direction to the surface that it leaves, positive; without one 1
  };
  /// All numbers in [0, 1): which light and which target; where on the light, or across the direction; in which
  /// direction. None is valid where it is empty.
  Photon8 emit(Pair8 choice, Pair8 position, Pair8 direction) const;

  /// The density with which `emit` draws that a light's ray leaves `point` (of light from infinitely far: goes through
  /// it) in a unit direction, at this cosine to the light's surface: per area of the surface, or across light from
  /// infinitely far; and per solid angle, but of directional lights. 0 where it draws none. The targets must hold all
  /// surfaces that emit.
  F8 pdf(U8 light, const V8& point, const V8& direction, F8 cosine, M8 lanes) const;
  /// See LightEmission.
  F8 cosine(U8 light, const V8& point, const V8& direction, M8 lanes) const {
    return sources_.cosine(light, point, direction, lanes);
  }

 private:
  struct Chosen8 {
    U8 light;
    F8 pmf;
    PhotonAim::Choice8 targets;
  };
  void build_choice(const PhotonFluxes& fluxes);
  void balance(std::vector<double>& fluxes) const;
  Chosen8 choose(Pair8 choice) const;
  V8 start_of(const V8& place, const V8& direction) const;
  void aim_near(const Chosen8& chosen, M8 lanes, Pair8 position, Pair8 direction, Photon8& out) const;
  void aim_distant(const Chosen8& chosen, M8 lanes, Pair8 position, Pair8 direction, Photon8& out) const;

  LightEmission sources_;
  PhotonAim aim_;
  std::vector<BoundlessPlane> planes_;
  Vec3 scene_center_;
  float scene_radius_;

  // Lights that can reach a target, in their order; `block_` of them in a row (the last ones may be fewer) are one
  // entry of the choice, among which none is preferred.
  std::vector<std::uint32_t> lights_;
  std::size_t block_ = 1;
  DiscreteDistribution by_flux_;
  // By the light's number, the environment's among them: its probability, and its entry.
  std::vector<float> pmf_of_light_;
  std::vector<std::uint32_t> entry_of_light_;
  std::vector<float> by_target_;  ///< of each entry: cumulative probabilities of the targets, one more than there are
};

}  // namespace lightmill
