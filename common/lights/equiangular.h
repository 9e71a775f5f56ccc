// Equiangular sampling: points on ray segments, in proportion to the light that bounded lights bring there.
//
// Light of a point at the distance h from a line falls off as 1/(h² + x²) along it. The density h/(h² + x²)/θ cancels
// this, where θ is the angle that the segment subtends at the light (Kulla and Fajardo 2012, "Importance Sampling
// Techniques for Path Tracing in Participating Media", 5).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/lights/light_sample.h"

namespace lightmill {

/// The lights of a scene in at most kMaxClusters clusters. Immutable once built, thread-safe.
class EquiangularLights {
 public:
  static constexpr std::size_t kMaxClusters = 16;

  EquiangularLights() = default;
  EquiangularLights(std::span<const LightBounds> bounded, std::span<const DistantBounds> distant);

  /// Eight segments in front of one cluster.
  struct Span8 {
    F8 middle;  ///< distance along the ray of the point nearest to the cluster; may be negative
    F8 height;  ///< distance of the cluster from the ray
    F8 first, last;
    F8 angle;  ///< that these subtend at the cluster
    F8 probability;

    F8 sample(F8 u) const;
    F8 pdf_length(F8 distance) const {
      const F8 x = distance - middle;
      return masked((distance >= first) & (distance <= last), height / (angle * (height * height + x * x)));
    }
  };
  /// A density on segments: the mixture of the clusters' ones, which leaves a rest of the probability to the caller.
  struct Mixture8 {
    std::array<Span8, kMaxClusters> spans;
    std::size_t size = 0;
    F8 rest;

    /// The clusters' part of the density.
    F8 pdf_length(F8 distance) const;
    /// Samples it for u.u in [rest, 1).
    F8 sample(Pair8 u) const;
  };
  /// Directions that pass clusters: a mixture of densities whose angle θ to the direction of a cluster is uniform in
  /// [0, π], which leaves a rest of the probability to the caller. A segment in that direction gets light as 1/sin θ, and
  /// the density 1/(2π² sin θ) per solid angle cancels this (Georgiev, Křivánek, Hachisuka, Nowrouzezahrai and Jarosz
  /// 2013, "Joint Importance Sampling of Low-Order Volumetric Scattering").
  struct Aim8 {
    struct Part8 {
      V8 axis;
      F8 probability;
    };
    std::array<Part8, kMaxClusters> parts;
    std::size_t size = 0;
    F8 rest;

    /// The clusters' part of the density.
    F8 pdf_solid_angle(const V8& wi) const;
    /// Samples it for u.u in [rest, 1).
    V8 sample(Pair8 u) const;
  };
  /// From these points. `reach`: mean length of segments that transmittance leaves, positive.
  Aim8 aim(const V8& point, F8 reach) const;

  /// Squared distance to the nearest cluster; 0 in a cluster, infinite without clusters.
  F8 nearest2(const V8& point) const;
  /// For rays with unit directions. `reach`: mean length of the segment that transmittance leaves, positive.
  Mixture8 mixture(const V8& origin, const V8& direction, F8 length, F8 reach) const;

 private:
  struct Cluster {
    Vec3 center;
    float radius2;
    float intensity;  ///< over that of all lights
    /// All light leaves in the cone about the axis from this point, if `in_cone`.
    Vec3 apex, axis;
    float cos_cone;
    bool in_cone;
  };
  Span8 span(const Cluster& cluster, const V8& origin, const V8& direction, F8 end) const;

  std::vector<Cluster> clusters_;
  float distant_ = 0;  ///< irradiance of distant lights, over the same unit
};

}  // namespace lightmill
