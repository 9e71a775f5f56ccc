// Density of the points on path segments where next-event estimation finds the light that a medium scatters.
#pragma once

#include "common/lights/equiangular.h"

namespace lightmill::tracer {

/// Mixture of equiangular sampling towards the lights, and of sampling by transmittance. All of it lies on the segment,
/// so thin media are sampled as often as thick ones. Channels count by the light that they scatter.
class InscatteringDensity8 {
 public:
  /// `scattered`: throughput times scattering, per length.
  InscatteringDensity8(const EquiangularLights& lights, const V8& origin, const V8& direction, F8 length,
                       const V8& scattered, const V8& extinction);

  /// Lanes whose segments scatter.
  M8 valid() const { return valid_; }
  /// Throughput that is scattered, summed over the channels.
  F8 total() const { return total_; }
  F8 sample(Pair8 u) const;
  F8 pdf_length(F8 distance) const;

 private:
  V8 extinction_;
  V8 lost_;    ///< 1 − transmittance of the segment
  V8 share_;   ///< probability of a channel
  V8 weight_;  ///< of a channel's transmittance in the density
  F8 length_, total_;
  M8 valid_;
  EquiangularLights::Mixture8 lights_;
};

}  // namespace lightmill::tracer
