// What a method is called and what it is told, as jobs write it: "path:brute-force", "whitted:flat,glass=0.1".
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
  /// `brute-force`: rays try every triangle rather than walk a hierarchy. The picture is the same but for rounding.
  bool brute_force = false;
  /// `distance=D`: how far ambient occlusion looks, in scene units, above 0; nothing: without end.
  std::optional<double> distance;
  /// `flat`: surfaces are shaded with their geometric normals.
  bool flat = false;
  /// `no-absorption`: what fills shapes lets all light pass.
  bool no_absorption = false;
  /// `caustic`: of photons, only those that have met casters first.
  bool caustic = false;
  /// `glass=R`: what smooth glass reflects, instead of what Fresnel's equations say.
  std::optional<double> glass;
  /// `photons=N`: of a pass, one a sample index; nothing: one for sixteen pixels of the film (of `vcm` for four), 4096
  /// to 65536.
  std::optional<std::uint32_t> photons;
  /// `radius=C`: of what is gathered in the first pass, in pixels; nothing: 1.5, of `vcm` 0.5, of `ppm` 3.
  std::optional<double> radius;
};
inline constexpr std::uint32_t kMostPhotons = 1u << 22;  ///< of a pass

/// Stands for the method that a job's scene calls for (common/planner), which is fixed before anything is rendered.
inline constexpr std::string_view kAutoMethod = "auto";

/// The methods that there are, `auto` among them.
const std::vector<std::string_view>& method_names();
/// The same in words.
std::string_view method_list();
/// What each shows, and its parameters, as in "photons=N, brute-force".
struct MethodAbout {
  std::string_view name, summary, parameters;
};
std::vector<MethodAbout> method_abouts();

/// Whether a method shows a scene by its lights: without any, its picture is black.
bool method_needs_light(std::string_view name);
/// Whether a method follows light from surface to surface, so that a limit of bounces means something.
bool method_bounces(std::string_view name);

/// Whether a method gathers photons within a radius, which blurs: what its error is said to be then wants the layer
/// `bias`.
bool method_gathers(std::string_view name);

/// What a worker holds of the passes of photons that a job's tiles share.
inline constexpr std::uint64_t kHeldPassBytes = std::uint64_t{256} << 20;
/// 0: tiles have no work in common. Else each worker does a sample's pass once for all its tiles, and holds those of so
/// many samples: ranges are not to be longer.
std::uint32_t shared_samples(const MethodSpec& method);
/// Into ranges of which level to cut one of `level` that is rendered tile after tile: where tiles have work in common,
/// into single samples. A pass of a closed bright room may be so heavy that two are not held.
std::uint32_t level_at_a_time(const MethodSpec& method, std::uint32_t level);

/// Where no limit is asked for, a path of `path` still ends after so many scatterings (a closed room of albedo 1 has no
/// other end).
inline constexpr std::uint32_t kMaxBounces = 1000;
/// The limit that `max_bounces` asks for; 0 stands for this one.
constexpr std::uint32_t bounce_limit(std::uint32_t max_bounces) {
  return max_bounces == 0 ? kMaxBounces : max_bounces;
}
/// That may be asked for.
inline constexpr std::uint32_t kMostBounces = 1'000'000;

/// Scatterings that `whitted` follows at most, and if it is not told.
inline constexpr std::uint32_t kMaxWhittedBounces = 128;
/// INVALID_ARGUMENT if the method cannot follow light so far; 0 stands for its own limit.
Status check_max_bounces(std::string_view method, std::uint32_t max_bounces);

/// INVALID_ARGUMENT if the method does not follow light through such media.
Status check_method_media(std::string_view method, bool scattering);

/// INVALID_ARGUMENT for an unknown method, a parameter that it does not take, or a value out of range: the message
/// names it and what is expected.
Result<MethodSpec> parse_method(std::string_view text);

}  // namespace lightmill
