// Light followed from its source: where it starts, and how much goes where; all kinds of lights by their numbers.
#pragma once

#include "common/lights/emission_point.h"
#include "common/lights/light_table.h"
#include "common/lights/photon_aim.h"

namespace lightmill {

/// Eight lanes may ask for lights of different kinds. The environment's number is `first(LightKind::environment)`, also
/// where the table does not sample it.
class LightEmission {
 public:
  /// The table must live as long.
  explicit LightEmission(const LightTable& table) : table_(&table) {}

  /// Lights from this number on are infinitely far away.
  std::uint32_t first_distant() const { return table_->first(LightKind::directional); }

  // ---- of lights that are somewhere ----

  /// Of a surface, uniform by area.
  EmissionPoint8 point_on(U8 light, M8 lanes, Pair8 u) const;
  /// Which of the lanes are spheres that shine outward alone, and where they are.
  using Bulbs8 = PhotonAim::Bulbs8;
  Bulbs8 bulbs(U8 light, M8 lanes) const;
  /// Of those, where their unit normal is this; what it stands for is all of their area.
  EmissionPoint8 point_on_bulb(U8 light, M8 bulbs, const V8& outward) const;
  /// What leaves the point in unit directions, W/sr: from surfaces the radiance by the area that it stands for.
  V8 intensity(U8 light, const EmissionPoint8& from, const V8& direction, M8 lanes) const;

  /// Of a unit direction to the surface at a point of it, positive; of lights without extent 1.
  F8 cosine(U8 light, const V8& point, const V8& direction, M8 lanes) const;

  // ---- of lights infinitely far away ----

  struct Parallel8 {
    V8 direction;   ///< unit, in which light travels; of an environment drawn by how much comes
    V8 irradiance;  ///< W/m² across the direction; of an environment the radiance over the direction's density
  };
  Parallel8 parallel(U8 light, M8 lanes, Pair8 u) const;
  /// The density per solid angle of its directions; of directional lights 1.
  F8 parallel_pdf(U8 light, M8 lanes, const V8& direction) const;

 private:
  /// Calls take(kind, index within the kind, lanes) for the kinds of these lights.
  template <class Take>
  void for_each_kind(U8 light, M8 lanes, Take take) const;

  const LightTable* table_;
};

}  // namespace lightmill
