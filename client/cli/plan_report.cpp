#include "client/cli/plan_report.h"

#include <nlohmann/json.hpp>

#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

json named_json(const NamedItems& things) {
  return {{"count", things.count}, {"names", things.names}};
}

std::string_view name_of(SceneFacts::Environment environment) {
  switch (environment) {
    case SceneFacts::Environment::none:
      return "none";
    case SceneFacts::Environment::constant:
      return "constant";
    case SceneFacts::Environment::image:
      return "image";
  }
  return "";
}

json facts_json(const SceneFacts& facts) {
  return {{"delta_lights", named_json(facts.delta_lights)},
          {"small_emitters", named_json(facts.small_emitters)},
          {"distant_lights", named_json(facts.distant_lights)},
          {"emissive_objects", facts.emissive_objects},
          {"environment", name_of(facts.environment)},
          {"casters", named_json(facts.casters)},
          {"smooth_casters", named_json(facts.smooth_casters)},
          {"boundless_casters", named_json(facts.boundless_casters)},
          {"smooth_layers", named_json(facts.smooth_layers)},
          {"boundless_layers", named_json(facts.boundless_layers)},
          {"unsampled_emitters", named_json(facts.unsampled_emitters)},
          {"hidden_emitters", named_json(facts.hidden_emitters)},
          {"receivers", facts.receivers},
          {"absorption", facts.absorption},
          {"scattering", facts.scattering},
          {"textures", facts.textures},
          {"holdouts", facts.holdouts},
          {"lens", facts.lens},
          {"largest_albedo", facts.largest_albedo},
          {"lossless", facts.lossless}};
}

}  // namespace

json plan_json(const SceneFacts& facts) {
  json methods = json::array();
  for (const Verdict& verdict : admit_all(facts)) {
    methods.push_back({{"name", verdict.method}, {"admitted", verdict.admitted}, {"reason", verdict.reason}});
  }
  const MethodPlan plan = plan_method(facts, kAutoMethod);
  return {{"facts", facts_json(facts)},
          {"features", features_of(facts)},
          {"methods", methods},
          {"auto", {{"methods", plan.candidates}, {"reasons", plan.reasons}}}};
}

ReportRows plan_rows(const SceneFacts& facts) {
  ReportRows rows = fact_rows(facts);
  for (const Verdict& verdict : admit_all(facts)) {
    rows.push_back({"method " + verdict.method,
                    verdict.admitted ? "finds all light" + (verdict.reason.empty() ? "" : "; " + verdict.reason)
                                     : "misses light: " + verdict.reason});
  }
  const MethodPlan plan = plan_method(facts, kAutoMethod);
  rows.push_back(
      {"auto chooses", fmt::format("{}: {}{}", fmt::join(plan.candidates, " or "), fmt::join(plan.reasons, "; "),
                                   plan.candidates.size() > 1 ? "; a pilot picks one" : "")});
  return rows;
}

}  // namespace lightmill::cli
