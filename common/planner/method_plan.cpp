#include "common/planner/method_plan.h"

#include <array>

#include "common/methods/spec/method_spec.h"

namespace lightmill {
namespace {

std::string_view name_of(std::string_view method) {
  return method.substr(0, method.find(':'));
}

/// "the point light 'bulb'", or the first of several with their number. `others`: the plural of the noun.
std::string first_of(const NamedItems& things, std::string_view others) {
  if (things.count == 2) {
    return fmt::format("{} (and 1 more {})", things.names.front(), others.substr(0, others.size() - 1));
  }
  return things.count == 1 ? things.names.front()
                           : fmt::format("{} (and {} more {})", things.names.front(), things.count - 1, others);
}

/// Caustics that only paths from a light find. Camera paths never hit lights without extent, and rarely small ones.
/// Light sampling finds nothing through surfaces that scatter narrowly.
struct UnseenCaustics {
  bool by_casters = false;  ///< casters, through which `caustic` follows light
  bool by_layers = false;   ///< layers of surfaces that `caustic` treats as receivers
  explicit UnseenCaustics(const SceneFacts& facts) {
    const bool emitters = facts.receivers && !(facts.delta_lights.empty() && facts.small_emitters.empty());
    by_casters = emitters && !facts.smooth_casters.empty();
    by_layers = emitters && !facts.smooth_layers.empty();
  }
};

/// With so small a share of all photons, even many passes give none.
constexpr double kFewPhotons = 1e-8;

/// `ppm`: photons start at sampled lights. Photons of distant light cover only bounded shapes.
Verdict admit_ppm(const SceneFacts& facts) {
  if (!facts.unsampled_emitters.empty()) {
    return {"ppm", false,
            fmt::format("{} emits no photons, so its light on other surfaces is missing",
                        first_of(facts.unsampled_emitters, "emitters"))};
  }
  if (facts.planes && (!facts.distant_lights.empty() || facts.environment != SceneFacts::Environment::none)) {
    return {"ppm", false,
            "an infinite plane is dark far away, because photons of directional lights and environments cover only "
            "the part near bounded objects"};
  }
  constexpr double kGatherArea = 3 * 3;  // default radius, in pixels
  if (facts.pixel_share < kFewPhotons / kGatherArea) {
    return {"ppm", false,
            fmt::format("the picture shows so little of the scene that a pixel gathers one of {:.0e} photons",
                        1 / (kGatherArea * facts.pixel_share))};
  }
  return {"ppm", true, "it is for checking other methods: its noise and blur are large"};
}

/// Reason about lights that no method samples. Empty if enough paths hit each of them.
std::string hidden_reason(const SceneFacts& facts) {
  if (facts.hidden_emitters.empty() || !facts.receivers) {
    return "";
  }
  return fmt::format(
      "no method samples {}, and paths rarely hit so small an emitter, so its light on other surfaces is missing",
      first_of(facts.hidden_emitters, "emitters"));
}

/// Reason about distant light that photons miss by way of these planes. Empty if there is none.
std::string infinite_reason(const SceneFacts& facts, const NamedItems& planes) {
  if (facts.distant_lights.empty() || planes.empty() || !facts.receivers) {
    return "";
  }
  return fmt::format(
      "{} shines on {}, which is infinite: photons cover only the part near other objects and the camera, so "
      "light from farther away is missing",
      first_of(facts.distant_lights, "lights"), first_of(planes, "planes"));
}

Verdict admit_vcm(const SceneFacts& facts) {
  if (facts.scattering) {
    return {"vcm", false, "it does not follow light in scattering media"};
  }
  for (std::string reason : {hidden_reason(facts), infinite_reason(facts, facts.infinite_casters),
                             infinite_reason(facts, facts.infinite_layers)}) {
    if (!reason.empty()) {
      return {"vcm", false, std::move(reason)};
    }
  }
  const bool caustics = !facts.casters.empty() || !facts.smooth_layers.empty();
  return {"vcm", true, caustics ? "" : "nothing in the scene causes caustics, so path finds all light with less work"};
}

/// "camera paths never hit the point light 'bulb', so its light".
std::string unmet_light(const SceneFacts& facts) {
  return facts.delta_lights.empty()
             ? fmt::format("camera paths rarely hit so small a light as {}, so its light",
                           first_of(facts.small_emitters, "emitters"))
             : fmt::format("camera paths never hit {}, so its light", first_of(facts.delta_lights, "lights"));
}

/// The method that finds light by way of smooth layers, which `caustic` treats as receivers.
std::string_view finder_of_layers(const SceneFacts& facts) {
  return admit_vcm(facts).admitted ? "vcm" : admit_ppm(facts).admitted ? "ppm alone" : "no method";
}

/// Light that surfaces reflect like a mirror, besides scattering it.
Verdict without_layers(std::string_view method, const SceneFacts& facts) {
  return {std::string(method), false,
          fmt::format("{} from the smooth layer of {} is missing", unmet_light(facts),
                      first_of(facts.smooth_layers, "objects")),
          std::string(finder_of_layers(facts))};
}

Verdict admit_caustic(const SceneFacts& facts) {
  if (UnseenCaustics(facts).by_layers) {
    return without_layers("caustic", facts);
  }
  if (std::string reason = hidden_reason(facts); !reason.empty()) {
    return {"caustic", false, std::move(reason)};
  }
  if (std::string reason = infinite_reason(facts, facts.infinite_casters); !reason.empty()) {
    return {"caustic", false, std::move(reason)};
  }
  return {"caustic", true,
          facts.casters.empty() ? "nothing in the scene causes caustics, so path finds all light with less work" : ""};
}

/// The method that finds what camera paths miss.
std::string_view finder_of_caustics(const SceneFacts& facts) {
  return admit_caustic(facts).admitted ? "caustic" : finder_of_layers(facts);
}

Verdict admit_path(const SceneFacts& facts) {
  if (std::string reason = hidden_reason(facts); !reason.empty()) {
    return {"path", false, std::move(reason)};
  }
  const UnseenCaustics unseen(facts);
  if (!unseen.by_casters) {
    return unseen.by_layers ? without_layers("path", facts) : Verdict{"path", true, ""};
  }
  return {"path", false,
          fmt::format("{} by way of {} is missing", unmet_light(facts), first_of(facts.smooth_casters, "objects")),
          std::string(finder_of_caustics(facts))};
}

/// `raycast` and `whitted`, which omit light by design.
Verdict admit_simple(const SceneFacts& facts, std::string_view method) {
  std::string reason = method == "raycast" ? "it has no indirect light"
                                           : "its only indirect light is what mirrors and glass send to the camera";
  if (facts.emissive_objects + facts.sized_lights > 0) {
    reason += ", and it treats emitters as points";
  }
  return {std::string(method), false, std::move(reason)};
}

/// Candidates of `auto`, simplest first. `vcm` is taken only if these miss light, because it needs several times the
/// work of the better one.
constexpr std::array<std::string_view, 2> kCandidates{"path", "caustic"};

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
  if (name == "photon-map") {
    return {"photon-map", false, "it shows the photon map as points, and no light"};
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
      passed_over = fmt::format("{} misses light: {}", method, verdict.reason);
    }
  }
  if (candidates.size() > 1) {
    return {candidates,
            {fmt::format("two methods find all light, and {} may cause caustics", first_of(facts.casters, "objects"))}};
  }
  if (candidates.size() == 1) {
    const std::string reason = find_all.front() != kCandidates.front() ? passed_over
                               : facts.casters.empty() ? "it finds all light, and nothing in the scene causes caustics"
                                                       : "it finds all light, and caustic does not";
    return {candidates, {reason}};
  }
  if (admit_vcm(facts).admitted) {
    return {{"vcm" + parameters}, {passed_over}};
  }
  return UnseenCaustics(facts).by_casters
             ? MethodPlan{{"caustic" + parameters},
                          {"no method of auto finds all light, but caustic finds more than path"}}
             : MethodPlan{{"path" + parameters}, {"no method of auto finds all light, and none finds more than path"}};
}

std::vector<std::string> method_notices(const SceneFacts& facts, std::string_view method) {
  const Verdict verdict = admit(facts, method);
  std::vector<std::string> notices;
  if (!verdict.admitted && method_needs_light(name_of(method))) {
    notices.push_back(fmt::format("{}: {}{}", verdict.method, verdict.reason,
                                  verdict.finder.empty() ? "" : fmt::format(". {} finds it", verdict.finder)));
  }
  const bool counts_photons =
      verdict.method == "ppm" || (verdict.method == "caustic" && !facts.casters.empty()) || verdict.method == "vcm";
  if (counts_photons && !facts.point_meters.empty()) {
    notices.push_back(fmt::format(
        "{}: photons that reach {} are counted on a disc that shrinks with the samples. Where light varies within it, "
        "the reading is blurred, and its interval does not include this. A small patch has no such error",
        verdict.method, facts.point_meters.text()));
  }
  return notices;
}

}  // namespace lightmill
