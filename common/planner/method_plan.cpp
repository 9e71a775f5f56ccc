#include "common/planner/method_plan.h"

#include <array>

#include "common/methods/spec/method_spec.h"

namespace lightmill {
namespace {

std::string_view name_of(std::string_view method) {
  return method.substr(0, method.find(':'));
}

/// "the point light 'bulb'", or the first of several with their number; `others` is what all are called, with an s.
std::string first_of(const NamedThings& things, std::string_view others) {
  if (things.count == 2) {
    return fmt::format("{} (and 1 more {})", things.names.front(), others.substr(0, others.size() - 1));
  }
  return things.count == 1 ? things.names.front()
                           : fmt::format("{} (and {} more {})", things.names.front(), things.count - 1, others);
}

/// Light that only paths that start at a lamp find: lamps without extent are met by none from the camera, small ones by
/// hardly any, and surfaces that scatter narrowly let through none of the light that is sampled.
struct UnseenCaustics {
  bool by_casters = false;  ///< that `caustic` follows light through
  bool by_layers = false;   ///< on surfaces that it takes for receivers
  explicit UnseenCaustics(const SceneFacts& facts) {
    const bool lamps = facts.receivers && !(facts.delta_lights.empty() && facts.small_lamps.empty());
    by_casters = lamps && !facts.smooth_casters.empty();
    by_layers = lamps && !facts.smooth_layers.empty();
  }
};

/// Photons are not followed through media that scatter.
bool photons_render(const SceneFacts& facts) {
  return !facts.scattering;
}

/// Of so small a share of all photons, passes without number bring none.
constexpr double kFewPhotons = 1e-8;

/// `ppm`: photons start at what next-event estimation samples, and light from infinitely far only around what is
/// bounded.
Verdict admit_ppm(const SceneFacts& facts) {
  if (!photons_render(facts)) {
    return {"ppm", false, "it renders no scattering media"};
  }
  if (!facts.lamps_never_sampled.empty()) {
    return {"ppm", false,
            fmt::format("no photons start at {}: what it throws on other surfaces is missing",
                        first_of(facts.lamps_never_sampled, "lamps"))};
  }
  if (facts.planes && (!facts.distant_lights.empty() || facts.environment != SceneFacts::Environment::none)) {
    return {"ppm", false,
            "a plane without end is dark where it lies far off: photons from suns and skies go only to "
            "the surroundings of what is bounded"};
  }
  constexpr double kGatherArea = 3 * 3;  // by default, in pixels
  if (facts.pixel_share < kFewPhotons / kGatherArea) {
    return {"ppm", false,
            fmt::format("so little of the scene is in the picture that a pixel gathers one photon of {:.0e}",
                        1 / (kGatherArea * facts.pixel_share))};
  }
  return {"ppm", true, "it is there to check the others: noise and blur are large"};
}

/// Of lamps that no method samples; empty where each is met by enough paths.
std::string hidden_reason(const SceneFacts& facts) {
  if (facts.hidden_lamps.empty() || !facts.receivers) {
    return "";
  }
  return fmt::format(
      "no method draws points on {}, and hardly any path meets so small a lamp by chance: what it throws on "
      "other things is missing",
      first_of(facts.hidden_lamps, "lamps"));
}

/// What photons of light from infinitely far leave out where it goes by way of these planes; empty where that is
/// nothing.
std::string boundless_reason(const SceneFacts& facts, const NamedThings& planes) {
  if (facts.distant_lights.empty() || planes.empty() || !facts.receivers) {
    return "";
  }
  return fmt::format(
      "{} shines on {}, which has no end: its photons cover what lies around the other things and the "
      "eye, and what comes from farther off is missing",
      first_of(facts.distant_lights, "lights"), first_of(planes, "planes"));
}

Verdict admit_vcm(const SceneFacts& facts) {
  if (!photons_render(facts)) {
    return {"vcm", false, "it renders no scattering media"};
  }
  for (std::string reason : {hidden_reason(facts), boundless_reason(facts, facts.boundless_casters),
                             boundless_reason(facts, facts.boundless_layers)}) {
    if (!reason.empty()) {
      return {"vcm", false, std::move(reason)};
    }
  }
  const bool caustics = !facts.casters.empty() || !facts.smooth_layers.empty();
  return {"vcm", true, caustics ? "" : "nothing casts caustics: path finds the light with less work"};
}

/// Of the lights that paths from the camera do not meet.
std::string unmet_light(const SceneFacts& facts) {
  return facts.delta_lights.empty() ? first_of(facts.small_lamps, "lamps") : first_of(facts.delta_lights, "lights");
}

std::string layers_reason(const SceneFacts& facts) {
  return fmt::format("{} shines on {}, which reflects some of it as a mirror does: where that goes, {} finds it",
                     unmet_light(facts), first_of(facts.smooth_layers, "objects"),
                     admit_vcm(facts).admitted   ? "vcm"
                     : admit_ppm(facts).admitted ? "ppm alone"
                                                 : "no method that there is");
}

Verdict admit_caustic(const SceneFacts& facts) {
  if (!photons_render(facts)) {
    return {"caustic", false, "it renders no scattering media"};
  }
  if (UnseenCaustics(facts).by_layers) {
    return {"caustic", false, layers_reason(facts)};
  }
  if (std::string reason = hidden_reason(facts); !reason.empty()) {
    return {"caustic", false, std::move(reason)};
  }
  if (std::string reason = boundless_reason(facts, facts.boundless_casters); !reason.empty()) {
    return {"caustic", false, std::move(reason)};
  }
  return {"caustic", true, facts.casters.empty() ? "nothing casts caustics: it is path with more work" : ""};
}

/// Who finds what paths from the camera do not.
std::string_view finder_of_caustics(const SceneFacts& facts) {
  return admit_caustic(facts).admitted ? "caustic"
         : admit_vcm(facts).admitted   ? "vcm"
         : admit_ppm(facts).admitted   ? "ppm alone"
                                       : "no method that there is";
}

Verdict admit_path(const SceneFacts& facts) {
  if (std::string reason = hidden_reason(facts); !reason.empty()) {
    return {"path", false, std::move(reason)};
  }
  const UnseenCaustics unseen(facts);
  if (!unseen.by_casters) {
    return unseen.by_layers ? Verdict{"path", false, layers_reason(facts)} : Verdict{"path", true, ""};
  }
  return {
      "path", false,
      fmt::format("{} shines on {}: what that sends on to other surfaces is missing, because paths from the camera "
                  "{}; {} finds it",
                  unmet_light(facts), first_of(facts.smooth_casters, "objects"),
                  facts.delta_lights.empty() ? "hardly ever meet so small a lamp" : "never meet a light without extent",
                  finder_of_caustics(facts))};
}

/// `raycast` and `whitted`, which leave light out by design.
Verdict admit_simple(const SceneFacts& facts, std::string_view method) {
  std::string reason = method == "raycast" ? "it shows no light that goes from surface to surface"
                                           : "of light that goes from surface to surface it follows only what mirrors "
                                             "and glass send to the camera";
  if (facts.emissive_objects > 0) {
    reason += ", and it takes lamps for points";
  }
  return {std::string(method), false, std::move(reason)};
}

/// What `auto` takes, the simplest first; `vcm` only where these miss light, for it needs several times the work of the
/// better one.
constexpr std::array<std::string_view, 2> kCandidates{"path", "caustic"};

/// Light enough for `caustic` to leave `path` for it, though neither finds all.
bool caustic_finds_more(const SceneFacts& facts) {
  return photons_render(facts) && UnseenCaustics(facts).by_casters;
}

}  // namespace

Verdict admit(const SceneFacts& facts, std::string_view method) {
  const std::string_view name = name_of(method);
  if (name == "path") {
    return admit_path(facts);
  }
  if (name == "caustic") {
    return admit_caustic(facts);
  }
  if (name == "vcm") {
    return admit_vcm(facts);
  }
  if (name == "ppm") {
    return admit_ppm(facts);
  }
  if (name == "photon-dots") {
    return {"photon-dots", false, "it shows where photons arrive, as points, and no light"};
  }
  if (name == "raycast" || name == "whitted") {
    return admit_simple(facts, name);
  }
  return {std::string(name), false, "it shows no light"};
}

std::vector<Verdict> admit_all(const SceneFacts& facts) {
  std::vector<Verdict> all;
  for (const std::string_view method : method_names()) {
    if (method != kAutoMethod) {
      all.push_back(admit(facts, method));
    }
  }
  return all;
}

MethodPlan plan_method(const SceneFacts& facts, std::string_view asked) {
  const std::string_view name = name_of(asked);
  if (name != kAutoMethod) {
    return {{std::string(asked)}, {}};
  }
  const std::string parameters(asked.substr(name.size()));
  std::vector<std::string> find_all, candidates;
  std::string passed_over;
  for (const std::string_view method : kCandidates) {
    const Verdict verdict = admit(facts, method);
    if (verdict.admitted && verdict.reason.empty()) {
      find_all.emplace_back(method);
      candidates.push_back(find_all.back() + parameters);
    } else if (!verdict.admitted && passed_over.empty()) {
      passed_over = fmt::format("{} does not do: {}", method, verdict.reason);
    }
  }
  if (candidates.size() > 1) {
    return {candidates,
            {fmt::format("{} find all of the light, some of which {} may gather in caustics",
                         fmt::join(find_all, " and "), first_of(facts.casters, "objects"))}};
  }
  if (candidates.size() == 1) {
    const std::string reason = find_all.front() != kCandidates.front() ? passed_over
                               : facts.casters.empty() ? "it finds all of the light, and nothing casts caustics"
                                                       : "it finds all of the light, as no other method does";
    return {candidates, {reason}};
  }
  if (admit_vcm(facts).admitted) {
    return {{"vcm" + parameters}, {passed_over}};
  }
  return caustic_finds_more(facts)
             ? MethodPlan{{"caustic" + parameters},
                          {"no method that auto takes finds all of the light; it finds more than path"}}
             : MethodPlan{{"path" + parameters}, {"no method that auto takes finds all of the light; none finds more"}};
}

std::vector<std::string> method_notices(const SceneFacts& facts, std::string_view method) {
  const Verdict verdict = admit(facts, method);
  std::vector<std::string> notices;
  if (!verdict.admitted && method_needs_light(name_of(method))) {
    notices.push_back(fmt::format("{}: {}", verdict.method, verdict.reason));
  }
  const bool counts_photons =
      verdict.method == "ppm" || (verdict.method == "caustic" && !facts.casters.empty()) || verdict.method == "vcm";
  if (counts_photons && !facts.point_meters.empty()) {
    notices.push_back(fmt::format(
        "{}: photons that come to {} are counted on a disc around it, which shrinks with the samples: where light "
        "changes within it the reading is blurred, which its interval does not tell; a small patch has no such error",
        verdict.method, facts.point_meters.text()));
  }
  return notices;
}

}  // namespace lightmill
