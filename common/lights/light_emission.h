// Emission of all kinds of lights, by light number: start points of light paths, and intensity by direction.
#pragma once

#include "common/lights/light_sample.h"
#include "common/lights/light_table.h"
#include "common/lights/photon_aim.h"

namespace lightmill {

/// Each of eight lanes may have another kind of light. The environment's number is `first(LightKind::environment)`,
/// also if the table does not sample it.
class LightEmission {
 public:
  /// The table must outlive this object.
  explicit LightEmission(const LightTable& table) : table_(&table) {}

  /// Lights from this number on are infinitely distant.
  std::uint32_t first_distant() const { return table_->first(LightKind::directional); }

  // ---- bounded lights ----

  /// On surfaces, uniform by area.
  EmissionPoint8 point_on(U8 light, M8 lanes, Pair8 u) const;
  /// Lanes whose lights are spherical and shine only outward, with their centres and radii. These are one-sided sphere
  /// lights, and point lights and spots with a radius.
  using LightSpheres8 = PhotonAim::LightSpheres8;
  LightSpheres8 spheres(U8 light, M8 lanes) const;
  /// The point of these spheres with this unit normal. Its area is that of the whole sphere.
  EmissionPoint8 point_on_sphere(U8 light, M8 spheres, const V8& outward) const;
  /// Intensity from the point in unit directions, W/sr. For surfaces it is the radiance times the point's area.
  V8 intensity(U8 light, const EmissionPoint8& from, const V8& direction, M8 lanes) const;

  /// Cosine between a unit direction and the surface at a point of it, positive; 1 for lights without extent.
  F8 cosine(U8 light, const V8& point, const V8& direction, M8 lanes) const;

  // ---- infinitely distant lights ----

  struct Parallel8 {
    V8 direction;   ///< unit, the direction of travel; of environments and disks, drawn in proportion to the light
    V8 irradiance;  ///< W/m² across the direction; of environments and disks, the radiance over the direction's density
  };
  Parallel8 parallel(U8 light, M8 lanes, Pair8 u) const;
  /// Density per solid angle of the directions; 1 for parallel light.
  F8 parallel_pdf(U8 light, M8 lanes, const V8& direction) const;

 private:
  /// Calls take(kind, index within the kind, lanes) for the kinds of these lights.
  template <class Take>
  void for_each_kind(U8 light, M8 lanes, Take take) const;

  const LightTable* table_;
};

}  // namespace lightmill
