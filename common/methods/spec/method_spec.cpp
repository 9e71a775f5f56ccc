#include "common/methods/spec/method_spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/base/suggestion.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

struct Entry {
  std::string_view name;
  std::string_view parameters;  ///< as help texts show them
  std::string_view summary;     ///< what it computes
  bool lit;                     ///< uses the scene's lights
  bool bounces;                 ///< follows light from surface to surface
};
constexpr std::array kMethods{
    Entry{kAutoMethod, "brute-force", "chooses path, caustic or vcm by the scene", true, true},
    Entry{"path", "brute-force", "all light but caustics of very small lights", true, true},
    Entry{"caustic", "photons=N, radius=C, no-absorption, brute-force", "all light, with photons for caustics", true,
          true},
    Entry{"vcm", "photons=N, radius=C, no-absorption, brute-force",
          "all light, by paths from both ends (vertex connection and merging)", true, true},
    Entry{"ppm", "photons=N, radius=C, no-absorption, brute-force",
          "all light by photons alone, to check other methods", true, true},
    Entry{"photon-map", "photons=N, caustic, no-absorption, brute-force", "the photon map, as points", true, true},
    Entry{"preview", "brute-force", "flat colours", false, false},
    Entry{"ao", "distance=D, brute-force", "ambient occlusion", false, false},
    Entry{"raycast", "flat, brute-force", "direct light with hard shadows", true, false},
    Entry{"whitted", "glass=R, flat, brute-force", "direct light, also through mirrors and smooth glass", true, true},
};

bool follows_photons(std::string_view name) {
  return name == "caustic" || name == "vcm" || name == "ppm" || name == "photon-map";
}

const Entry* find_method(std::string_view name) {
  const auto* const entry = std::ranges::find(kMethods, name, &Entry::name);
  return entry == kMethods.end() ? nullptr : entry;
}

Result<double> bounded_number(std::string_view key, std::string_view text, double low, double high) {
  const std::optional<double> value = parse_number<double>(text);
  if (!value || !(*value >= low && *value <= high)) {
    return invalid_argument("{}: a number from {} to {} is expected, got '{}'", key, low, high, text);
  }
  return *value;
}

/// Whether a list such as "a, b=X, c" has the parameter.
bool takes(const Entry& entry, std::string_view key) {
  for (std::size_t at = 0; at < entry.parameters.size();) {
    const std::size_t end = std::min(entry.parameters.find(", ", at), entry.parameters.size());
    const std::string_view one = entry.parameters.substr(at, end - at);
    if (one.substr(0, one.find('=')) == key) {
      return true;
    }
    at = end + 2;
  }
  return false;
}

/// The field of a parameter without a value, or null.
bool* word_of(std::string_view key, MethodSpec& spec) {
  return key == "brute-force"     ? &spec.brute_force
         : key == "flat"          ? &spec.flat
         : key == "caustic"       ? &spec.caustic
         : key == "no-absorption" ? &spec.no_absorption
                                  : nullptr;
}

Status set_parameter(const Entry& entry, std::string_view text, MethodSpec& spec) {
  const std::size_t equals = text.find('=');
  const std::string_view key = text.substr(0, equals);
  if (!takes(entry, key)) {
    return invalid_argument("{} has no parameter '{}'. Parameters: {}", entry.name, key, entry.parameters);
  }
  if (bool* const word = word_of(key, spec)) {
    *word = true;
    return equals == std::string_view::npos ? ok_status() : invalid_argument("{} takes no value, got '{}'", key, text);
  }
  const std::string_view value = equals == std::string_view::npos ? "" : text.substr(equals + 1);
  if (key == "glass") {
    LM_ASSIGN_OR_RETURN(spec.glass, bounded_number(key, value, 0, 1));
    return ok_status();
  }
  if (key == "photons") {
    LM_ASSIGN_OR_RETURN(const double photons, bounded_number(key, value, 1, kMaxPhotons));
    if (photons != std::floor(photons)) {
      return invalid_argument("photons: a whole number is expected, got '{}'", value);
    }
    spec.photons = static_cast<std::uint32_t>(photons);
    return ok_status();
  }
  if (key == "radius") {
    LM_ASSIGN_OR_RETURN(spec.radius, bounded_number(key, value, 0.01, 1000));
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(spec.distance, bounded_number(key, value, 0, 1e12));
  return *spec.distance > 0
             ? ok_status()
             : invalid_argument("{}: a number above 0 is expected, got '{}'. Without it there is no limit", key, value);
}

}  // namespace

const std::vector<std::string_view>& method_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all;
    std::ranges::transform(kMethods, std::back_inserter(all), &Entry::name);
    return all;
  }();
  return names;
}

std::string_view method_list() {
  static const std::string list = fmt::format("{}", fmt::join(method_names(), ", "));
  return list;
}

bool method_needs_light(std::string_view name) {
  const Entry* const entry = find_method(name);
  return entry != nullptr && entry->lit;
}

bool method_bounces(std::string_view name) {
  const Entry* const entry = find_method(name);
  return entry != nullptr && entry->bounces;
}

bool method_gathers(std::string_view name) {
  return name == "caustic" || name == "vcm" || name == "ppm";
}

std::uint32_t shared_samples(const MethodSpec& method) {
  // Stored photons with their search structures, per emitted photon, in rooms full of glass and mirrors.
  constexpr std::uint64_t kBytesPerPhoton = 512, kMaxSharedSamples = 32;
  if (!follows_photons(method.name)) {
    return 0;
  }
  const std::uint64_t pass = method.photons.value_or(kMaxDefaultPhotons) * kBytesPerPhoton;
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(kHeldPassBytes / pass, 1, kMaxSharedSamples));
}

std::uint32_t level_at_a_time(const MethodSpec& method, std::uint32_t level) {
  return shared_samples(method) == 0 ? level : 0;
}

std::vector<MethodDescription> method_descriptions() {
  std::vector<MethodDescription> abouts;
  for (const Entry& entry : kMethods) {
    abouts.push_back({entry.name, entry.summary, entry.parameters});
  }
  return abouts;
}

std::uint32_t max_bounces_of(std::string_view method) {
  return method == "whitted" ? kMaxWhittedBounces : kMaxBounces;
}

Status check_max_bounces(std::string_view method, std::uint32_t max_bounces) {
  const std::uint32_t most = max_bounces_of(method);
  return max_bounces <= most ? ok_status()
                             : invalid_argument("{} follows at most {} bounces, got {}", method, most, max_bounces);
}

Status check_method_media(std::string_view method, bool scattering) {
  return method != "vcm" || !scattering
             ? ok_status()
             : invalid_argument("{} does not support scattering media, but path and caustic do", method);
}

Result<MethodSpec> parse_method(std::string_view text) {
  const std::size_t colon = text.find(':');
  MethodSpec spec;
  spec.name = text.substr(0, colon);
  const Entry* const entry = find_method(spec.name);
  if (entry == nullptr) {
    return invalid_argument("{}", unknown_text("method", spec.name, {method_names().begin(), method_names().end()}));
  }
  std::set<std::string_view> given;
  for (std::size_t at = colon; at != std::string_view::npos && at < text.size();) {
    const std::size_t end = text.find(',', at + 1);
    const std::string_view parameter = text.substr(at + 1, end == std::string_view::npos ? end : end - at - 1);
    LM_RETURN_IF_ERROR(set_parameter(*entry, parameter, spec));
    const std::string_view key = parameter.substr(0, parameter.find('='));
    if (!given.insert(key).second) {
      return invalid_argument("{} is given twice", key);
    }
    at = end;
  }
  return spec;
}

}  // namespace lightmill
