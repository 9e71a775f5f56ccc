// All lights of a scene in one table: what next-event estimation draws from, and with which density.
//
// One light is chosen (light_choice.h), then a point on it or a direction to it (a file per kind of light). The same
// densities answer for light that a scattered ray finds by itself (multiple importance sampling). Immutable once built,
// thread-safe.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "common/lights/cosine_power_light.h"
#include "common/lights/directional_light.h"
#include "common/lights/environment_light.h"
#include "common/lights/facet_light.h"
#include "common/lights/ies_light.h"
#include "common/lights/light_choice.h"
#include "common/lights/point_light.h"
#include "common/lights/sphere_light.h"
#include "common/lights/spot_light.h"

namespace lightmill {

/// Lights are numbered in this order of kinds, and within a kind as they were added.
enum class LightKind { facet, sphere, point, spot, cosine_power, ies, directional, environment };
inline constexpr int kLightKinds = 8;

class LightTable {
 public:
  FacetLights facets;
  SphereLights spheres;
  PointLights points;
  SpotLights spots;
  CosinePowerLights cosine_powers;
  IesLights ies;
  DirectionalLights directional;
  EnvironmentRadiance environment;

  /// After the last add. `scene_radius` is that of a sphere around the scene, in the frame that the lights are in.
  void build(double scene_radius);

  /// Lights that can be sampled.
  std::size_t size() const { return first_[kKinds]; }
  bool empty() const { return size() == 0; }
  /// The number of the first light of a kind.
  std::uint32_t first(LightKind kind) const { return first_[static_cast<int>(kind)]; }
  /// Whether `sample` looks at choice.u, and at choice.v as well.
  bool needs_choice() const { return !choice_.trivial(); }
  bool needs_second_choice() const { return choice_.needs_second_number(); }

  /// The numbers of the lights' groups, in the order of the lights.
  void set_groups(std::vector<std::uint32_t> groups) { group_ = std::move(groups); }
  U8 group(U8 light, M8 lanes) const { return gather(group_.data(), light, lanes); }

  /// Draws a light and a point on it for each shading point.
  LightSample8 sample(const V8& shading_point, Pair8 choice, Pair8 u) const;

  /// The one with this number, where it is no surface and no environment: nothing has to be drawn.
  LightSample8 sample_point(std::uint32_t light, const V8& p, M8 lanes) const;

  /// The probability with which `sample` at `from` chooses a light.
  F8 choice_pmf(const V8& from, U8 light, M8 lanes) const {
    return needs_choice() ? choice_.pmf(from, light, lanes) : masked(lanes, F8(1.0f));
  }
  /// Density per solid angle with which `sample` at `from` draws what a ray of this length found on an emissive facet
  /// or sphere, hit at this positive cosine to the normal.
  F8 pdf_solid_angle(const V8& from, U8 light, F8 distance, F8 cos_light, M8 lanes) const;
  /// The same for a ray in this direction that found the environment.
  F8 environment_pdf_solid_angle(const V8& from, const V8& direction, M8 lanes) const;
  std::uint64_t bytes() const;

 private:
  static constexpr int kKinds = kLightKinds;
  bool has(LightKind kind) const { return first_[static_cast<int>(kind)] < first_[static_cast<int>(kind) + 1]; }
  LightSample8 sample_of_kind(LightKind kind, const V8& p, U8 index, M8 lanes, Pair8 u) const;

  LightChoice choice_;
  std::vector<std::uint32_t> group_;
  LightKind only_kind_ = LightKind::facet;  ///< where there is but one light
  std::uint32_t first_[kKinds + 1] = {};
};

}  // namespace lightmill
