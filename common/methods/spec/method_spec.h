// Names and parameters of methods, as jobs write them: "path:brute-force", "whitted:flat,glass=0.1".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

struct MethodSpec {
  std::string name = "path";
  /// `brute-force`: rays test every triangle instead of walking a hierarchy. The picture is the same but for rounding.
  bool brute_force = false;
  /// `distance=D`: range of ambient occlusion, in scene units, above 0. Empty: unlimited.
  std::optional<double> distance;
  /// `flat`: surfaces are shaded with their geometric normals.
  bool flat = false;
  /// `no-absorption`: media absorb nothing.
  bool no_absorption = false;
  /// `caustic`: only photons that met casters first.
  bool caustic = false;
  /// `glass=R`: reflectance of smooth glass, instead of Fresnel's equations.
  std::optional<double> glass;
  /// `photons=N`: photons per pass. Empty: one for 16 pixels of the film (`vcm`: for 4), from 4096 to 65536.
  std::optional<std::uint32_t> photons;
  /// `radius=C`: gather radius in the first pass, in pixels. Empty: 1.5 (`vcm` 0.5, `ppm` 3).
  std::optional<double> radius;
};
inline constexpr std::uint32_t kMaxPhotons = 1u << 22;  ///< in a pass
inline constexpr std::uint32_t kMinDefaultPhotons = 4096, kMaxDefaultPhotons = 65536;

/// Placeholder for the method that the planner chooses for the scene, before anything is rendered.
inline constexpr std::string_view kAutoMethod = "auto";

/// All methods, `auto` included.
const std::vector<std::string_view>& method_names();
/// The same, separated by commas.
std::string_view method_list();
/// Name, summary and parameters of each method. Parameters are written as in "photons=N, brute-force".
struct MethodDescription {
  std::string_view name, summary, parameters;
};
std::vector<MethodDescription> method_descriptions();

/// Whether a method uses the scene's lights: without any, its picture is black.
bool method_needs_light(std::string_view name);
/// Whether a method follows light from surface to surface, so that it can take a bounce limit.
bool method_bounces(std::string_view name);

/// Whether a method gathers photons within a radius. Gathering blurs, so its error estimate needs the layer `bias`.
bool method_gathers(std::string_view name);

/// Bytes of photon passes that a worker caches for the tiles of a job.
inline constexpr std::uint64_t kHeldPassBytes = std::uint64_t{256} << 20;
/// Largest number of samples in a sample range, where tiles share photon passes. A worker traces each pass once and
/// caches this many. 0: tiles share no work.
std::uint32_t shared_samples(const MethodSpec& method);
/// The level of the pieces in which a range of `level` is rendered. Where tiles share work, pieces are single samples:
/// a pass of a closed bright room may be so large that the cache holds only one.
std::uint32_t level_at_a_time(const MethodSpec& method, std::uint32_t level);

/// Default limit of scatterings. A closed room of albedo 1 would never end a path.
inline constexpr std::uint32_t kDefaultBounces = 1000;
/// The limit for `max_bounces`, where 0 stands for the default.
constexpr std::uint32_t bounce_limit(std::uint32_t max_bounces) {
  return max_bounces == 0 ? kDefaultBounces : max_bounces;
}
/// The largest limit that users can set.
inline constexpr std::uint32_t kMaxBounces = 1'000'000;

/// Largest and default limit of `whitted`.
inline constexpr std::uint32_t kMaxWhittedBounces = 128;
/// The largest limit that users can set for this method.
std::uint32_t max_bounces_of(std::string_view method);
/// INVALID_ARGUMENT if the limit is too large for the method. 0 stands for its own limit.
Status check_max_bounces(std::string_view method, std::uint32_t max_bounces);

/// INVALID_ARGUMENT if the method does not support such media.
Status check_method_media(std::string_view method, bool scattering);

/// INVALID_ARGUMENT for an unknown method, a parameter that it does not take, or a value out of range. The message
/// names it and the expected values.
Result<MethodSpec> parse_method(std::string_view text);

}  // namespace lightmill
