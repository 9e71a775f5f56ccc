// Emission of photons from all lights of a table towards targets.
#pragma once

#include <span>
#include <vector>

#include "common/lights/light_emission.h"
#include "common/lights/photon_fluxes.h"
#include "common/sampling/discrete.h"

namespace lightmill {

/// Samples rays along which light leaves the lights. Immutable once built, thread-safe. The bits depend only on the
/// constructor's arguments and on the random numbers.
///
/// A light is chosen by an estimate of its flux to the targets, then a target in the same way. Surfaces emit from
/// points uniform by area, distant lights across the target's projection. Densities are those of the mixture over all
/// targets.
class PhotonEmission {
 public:
  /// `lights` must outlive this object. `scene`: a sphere around all bounded shapes and the camera. `planes`: all
  /// infinite planes. Distant light starts behind them. An infinite target is only the scene's sphere for distant
  /// light, which is missed where it hits a plane outside the sphere's projection. `unsampled`: whether an environment
  /// that the table does not sample also emits photons.
  PhotonEmission(const LightTable& lights, std::span<const BoundingSphere> targets,
                 std::span<const InfinitePlane> planes, const BoundingSphere& scene, bool unsampled = true);

  /// Whether there is nothing to emit: no target, or no light that can reach one.
  bool empty() const { return lights_.empty(); }

  struct Photon8 {
    V8 origin;     ///< off the emitting surface; of distant light, in front of everything
    V8 direction;  ///< unit
    /// W in each channel. For any function f of a ray, the mean of power · f over photons is the integral of f over all
    /// light from the lights towards at least one target. Invalid photons count as 0.
    V8 power;
    /// Number in the table. The environment's is `first(LightKind::environment)`, also if the table does not sample it.
    U8 light;
    M8 valid;   ///< false if there is no light: the dark side of a point, or a black texel
    F8 cosine;  ///< of the direction to the surface that it leaves, positive; 1 without a surface
  };
  /// All numbers are in [0, 1): choice of light and target; position on the light, or across the direction; direction.
  /// No photon is valid if this object is empty.
  Photon8 emit(Pair8 choice, Pair8 position, Pair8 direction) const;

  /// Density with which `emit` returns a ray of a light that leaves `point` in a unit direction. Rays of distant light
  /// pass through `point`. `cosine`: to the light's surface. The density is per area of the surface, or across distant
  /// light, and per solid angle, except for parallel light. 0 where no ray is drawn. The targets must contain all
  /// surfaces that emit.
  F8 pdf(U8 light, const V8& point, const V8& direction, F8 cosine, M8 lanes) const;
  /// As LightEmission::cosine.
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
  std::vector<InfinitePlane> planes_;
  Vec3 scene_center_;
  float scene_radius_;

  // Lights that can reach a target, in order. `block_` consecutive lights (the last block may have fewer) are one entry
  // of the choice, and equally likely.
  std::vector<std::uint32_t> lights_;
  std::size_t block_ = 1;
  DiscreteDistribution by_flux_;
  // Probability and entry by light number, including the environment's.
  std::vector<float> pmf_of_light_;
  std::vector<std::uint32_t> entry_of_light_;
  std::vector<float> by_target_;  ///< by entry: cumulative probabilities of the targets, one more than targets
};

}  // namespace lightmill
