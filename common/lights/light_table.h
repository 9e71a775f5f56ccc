// Table of all lights of a scene, from which next-event estimation samples.
//
// If there are few lights, each shading point samples all of them. Otherwise it samples one, which is chosen at random
// (light_choice.h). Then a point on the light or a direction to it is sampled (one file per kind of light). The same
// densities serve rays that hit a light (multiple importance sampling). Immutable once built, thread-safe.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "common/lights/cosine_power_light.h"
#include "common/lights/directional_light.h"
#include "common/lights/disk_light.h"
#include "common/lights/environment_light.h"
#include "common/lights/equiangular.h"
#include "common/lights/facet_light.h"
#include "common/lights/ies_light.h"
#include "common/lights/light_choice.h"
#include "common/lights/point_light.h"
#include "common/lights/sphere_light.h"
#include "common/lights/spot_light.h"

namespace lightmill {

/// Lights are numbered in this order of kinds, and within a kind in the order of `add`.
enum class LightKind { facet, sphere, disk, point, spot, cosine_power, ies, directional, environment };
inline constexpr int kLightKinds = 9;

class LightTable {
 public:
  FacetLights facets;
  SphereLights spheres;
  DiskLights disks;
  PointLights points;
  SpotLights spots;
  CosinePowerLights cosine_powers;
  IesLights ies;
  DirectionalLights directional;
  EnvironmentRadiance environment;

  /// Call it after the last add. `equiangular`: also prepares equiangular sampling.
  void build(bool equiangular = false);

  /// Lights that can be sampled.
  std::size_t size() const { return first_[kKinds]; }
  bool empty() const { return size() == 0; }
  /// Number of the first light of a kind.
  std::uint32_t first(LightKind kind) const { return first_[static_cast<int>(kind)]; }
  /// Light samples per shading point: one of each light, or one of a chosen light.
  std::uint32_t draws() const { return draws_; }
  /// Whether `sample` uses choice.u, and choice.v.
  bool needs_choice() const { return choice_.chooses(); }
  bool needs_second_choice() const { return choice_.needs_second_number(); }

  /// Density on segments by the light of all lights; without clusters, unless build() prepared it.
  const EquiangularLights& equiangular() const { return equiangular_; }

  /// Group number by light.
  void set_groups(std::vector<std::uint32_t> groups) { group_ = std::move(groups); }
  /// By light: 1 if camera rays pass it.
  void set_hidden(std::vector<std::uint8_t> hidden) { hidden_ = std::move(hidden); }
  U8 group(U8 light, M8 lanes) const { return gather(group_.data(), light, lanes); }

  /// Samples a light and a point on it for each shading point. `draw`: number of the sample, below draws(). The light
  /// at a shading point is the sum over all draws. `normal`: unit, of surfaces that light reaches only from above; zero
  /// elsewhere. The densities of the samples, which are for weights of multiple importance sampling, are those for a
  /// zero normal.
  LightSample8 sample(const V8& shading_point, std::uint32_t draw, Pair8 choice, Pair8 u, const V8& normal = {}) const {
    return needs_choice() ? sample_chosen(shading_point, choice_.sample(shading_point, normal, choice), u)
                          : sample_light(draw, shading_point, u);
  }
  /// The entries of the choice of lights.
  const LightChoice& choice() const { return choice_; }
  void set_visibility(LightVisibility visibility) { choice_.set_visibility(std::move(visibility)); }
  /// The same with a light of this entry.
  LightSample8 sample_entry(std::size_t entry, const V8& shading_point, Pair8 choice, Pair8 u) const {
    return sample_chosen(shading_point, choice_.sample_entry(entry, shading_point, choice), u);
  }
  /// The same without a choice, from the light with this number.
  LightSample8 sample_light(std::uint32_t light, const V8& shading_point, Pair8 u) const;

  /// The light with this number as if it had no size, so there is no random number. It must be neither a facet, a
  /// sphere nor an environment.
  LightSample8 sample_point(std::uint32_t light, const V8& p, M8 lanes) const;

  /// The probability that a sample at `from` is on this light, for a zero normal.
  F8 choice_pmf(const V8& from, U8 light, M8 lanes) const {
    return needs_choice() ? choice_.pmf(from, light, lanes) : masked(lanes, F8(1.0f));
  }
  /// Density per solid angle with which `sample` at `from` returns the point of a bounded light that a ray of this
  /// length hit. `cos_light`: cosine to the normal, positive.
  F8 pdf_solid_angle(const V8& from, U8 light, F8 distance, F8 cos_light, M8 lanes) const;
  /// The same for a ray that left the scene in this direction, which must be a direction to the light.
  F8 distant_pdf_solid_angle(const V8& from, U8 light, const V8& direction, M8 lanes) const;

  // Intersectable lights: those that rays can hit, although they are not surfaces of the scene. They block no light.

  /// Indices of the intersectable lights, ascending.
  const std::vector<std::uint32_t>& intersectable() const { return intersectable_; }
  bool is_hidden_from_camera(std::uint32_t light_index) const { return !hidden_.empty() && hidden_[light_index] == 1; }
  /// Lanes whose lights are intersectable.
  M8 are_intersectable(U8 light, M8 lanes) const {
    return intersectable_.empty() ? M8() : gather(is_intersectable_.data(), light, lanes) == U8(1u);
  }
  /// Calls take(spheres, index within the kind, lanes) for the kinds of these lights that have spheres.
  template <class Take>
  void for_each_spherical_kind(U8 light, M8 lanes, Take take) const {
    const auto visit = [&](LightKind kind, const auto& spheres) {
      const M8 some = and_not(lanes & signed_less(light, U8(first_[static_cast<int>(kind) + 1])),
                              signed_less(light, U8(first(kind))));
      if (spheres.radii().any() && some.any()) {
        take(spheres, light - U8(first(kind)), some);
      }
    };
    visit(LightKind::point, points);
    visit(LightKind::spot, spots);
  }
  struct LightHit8 {
    M8 hit;
    V8 point;     ///< as in LightSample8
    V8 radiance;  ///< towards the ray's origin
    F8 distance;
    F8 cosine;  ///< to the light's surface; 1 for distant light
  };
  /// Where rays with unit directions meet an intersectable light.
  LightHit8 meet(std::uint32_t light_index, const V8& origin, const V8& direction, M8 lanes) const;
  /// Density per solid angle with which `sample` at `from` returns the point where a ray met the light.
  F8 hit_pdf_solid_angle(std::uint32_t light_index, const V8& from, const V8& direction, const LightHit8& met,
                         M8 lanes) const;

  std::uint64_t bytes() const;

 private:
  static constexpr int kKinds = kLightKinds;
  bool has(LightKind kind) const { return first_[static_cast<int>(kind)] < first_[static_cast<int>(kind) + 1]; }
  LightSample8 sample_of_kind(LightKind kind, const V8& p, U8 index, M8 lanes, Pair8 u) const;
  LightSample8 sample_chosen(const V8& p, const LightChoice::Choice8& chosen, Pair8 u) const;
  LightKind kind_of(std::uint32_t light) const;
  void find_intersectable();

  LightChoice choice_;
  EquiangularLights equiangular_;
  std::vector<std::uint32_t> group_;
  std::vector<std::uint8_t> hidden_;
  std::vector<std::uint32_t> intersectable_;
  std::vector<std::uint32_t> is_intersectable_;  ///< 1 or 0 by light; empty if no light is intersectable
  std::uint32_t first_[kKinds + 1] = {};
  std::uint32_t draws_ = 0;
};

}  // namespace lightmill
