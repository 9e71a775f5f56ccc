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
  /// `glass=R`: what smooth glass reflects, instead of what Fresnel's equations say.
  std::optional<double> glass;
};

/// Stands for the method that a job's scene calls for (common/planner), which is fixed before anything is rendered.
inline constexpr std::string_view kAutoMethod = "auto";

/// The methods that there are, `auto` among them.
const std::vector<std::string_view>& method_names();
/// The same in words.
std::string_view method_list();
/// What each shows, and the parameters that it alone takes: "path: all light; …".
std::string_view method_help();

/// Whether a method shows a scene by its lights: without any, its picture is black.
bool method_needs_light(std::string_view name);
/// Whether a method follows light from surface to surface, so that a limit of bounces means something.
bool method_bounces(std::string_view name);

/// Scatterings that `whitted` follows at most, and if it is not told.
inline constexpr std::uint32_t kMaxWhittedBounces = 128;
/// INVALID_ARGUMENT if the method cannot follow light so far; 0 stands for its own limit.
Status check_max_bounces(std::string_view method, std::uint32_t max_bounces);

/// INVALID_ARGUMENT for an unknown method, a parameter that it does not take, or a value out of range: the message
/// names it and what is expected.
Result<MethodSpec> parse_method(std::string_view text);

}  // namespace lightmill
