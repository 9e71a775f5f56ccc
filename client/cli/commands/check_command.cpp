// lightmill check SCENE
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/scene_options.h"
#include "client/cli/table.h"
#include "common/base/file.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"
#include "common/scene/meter_reading.h"
#include "common/scene_io/scene_report.h"
#include "common/wire/scene_json.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

struct CheckOptions {
  SceneOptions scene;
  std::string save_camera;
};

/// `first`, and the counts by kind.
json counts_json(const std::string& name, std::size_t first, const SceneReport::Counts& counts) {
  json out{{name, first}};
  for (const auto& [kind, number] : counts) {
    out[kind] = number;
  }
  return out;
}

json meters_json(const std::vector<Meter>& meters) {
  json list = json::array();
  for (const Meter& meter : meters) {
    list.push_back({{"name", meter.name}, {"quantity", quantity_of(meter)}});
  }
  return list;
}

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
          {"infinite_casters", named_json(facts.infinite_casters)},
          {"smooth_layers", named_json(facts.smooth_layers)},
          {"infinite_layers", named_json(facts.infinite_layers)},
          {"unsampled_emitters", named_json(facts.unsampled_emitters)},
          {"hidden_emitters", named_json(facts.hidden_emitters)},
          {"receivers", facts.receivers},
          {"absorption", facts.absorption},
          {"scattering", facts.scattering},
          {"textures", facts.textures},
          {"shadow_catchers", facts.shadow_catchers},
          {"lens", facts.lens},
          {"largest_albedo", facts.largest_albedo},
          {"lossless", facts.lossless}};
}

/// The planner's facts, its verdicts, and the choice of `auto`.
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

/// Longer reasons are not repeated.
constexpr std::size_t kShortReason = 50;

/// The choice of `auto`. It leaves out reasons that the rows of methods have.
std::string choice_text(const MethodPlan& plan, const std::vector<Verdict>& verdicts) {
  const std::string chosen = fmt::format("{}", fmt::join(plan.candidates, " or "));
  if (plan.candidates.size() > 1) {
    return chosen + ": a pilot picks one";
  }
  const std::string reasons = fmt::format("{}", fmt::join(plan.reasons, "; "));
  const auto said = std::ranges::find_if(verdicts, [&](const Verdict& verdict) {
    return !verdict.reason.empty() && reasons.find(verdict.reason) != std::string::npos;
  });
  return said == verdicts.end() ? fmt::format("{}: {}", chosen, reasons)
                                : fmt::format("{}, because {} misses light", chosen, said->method);
}

ReportRows plan_rows(const SceneFacts& facts) {
  ReportRows rows = fact_rows(facts);
  const std::vector<Verdict> verdicts = admit_all(facts);
  for (const Verdict& verdict : verdicts) {
    const Verdict& first = *std::ranges::find(verdicts, verdict.reason, &Verdict::reason);
    const std::string reason =
        &first != &verdict && verdict.reason.size() > kShortReason ? "as with " + first.method : verdict.reason;
    rows.push_back({"method " + verdict.method, verdict.admitted
                                                    ? "finds all light" + (reason.empty() ? "" : "; " + reason)
                                                    : "misses light: " + reason});
  }
  rows.push_back({"auto chooses", choice_text(plan_method(facts, kAutoMethod), verdicts)});
  return rows;
}

json report_json(const LoadedScene& loaded, const SceneReport& report) {
  const Scene& scene = loaded.scene;
  json out{{"name", scene.name},
           {"width", scene.film.width},
           {"height", scene.film.height},
           {"materials", counts_json("count", scene.materials.size(), report.materials)},
           {"objects", scene.objects.size()},
           {"triangles", report.triangles},
           {"spheres", report.spheres},
           {"planes", report.planes},
           {"lights", counts_json("emissive_objects", report.emissive_objects, report.lights)},
           {"light_groups", light_groups_of(scene)},
           {"textures", scene.textures.size()},
           {"see_through_materials", report.facts.see_through.count},
           {"objects_with_vertex_colors", report.colored_objects},
           {"meters", meters_json(scene.meters)},
           {"assets", {{"count", loaded.assets.size()}, {"bytes", report.asset_bytes}}},
           {"camera",
            {{"eye", scene.camera.eye},
             {"look_at", scene.camera.look_at},
             {"up", scene.camera.up},
             {"vertical_fov_degrees", scene.camera.vertical_fov_degrees},
             {"shift", {scene.camera.shift_x, scene.camera.shift_y}}}},
           {"notices", loaded.notices}};
  out.update(plan_json(report.facts));
  return out;
}

void print(const Console& console, const LoadedScene& loaded, const SceneReport& report) {
  Rows rows = scene_rows(loaded, report);
  std::ranges::move(plan_rows(report.facts), std::back_inserter(rows));
  print_table(console, rows);
  for (const std::string& notice : loaded.notices) {
    console.result("note: " + notice);
  }
}

/// Replaces a camera file or an empty file, but no other.
Status save_camera(const std::string& path, const Camera& camera) {
  std::error_code error;
  if (std::filesystem::exists(path, error)) {
    const Result<std::string> there = read_file(path);
    if (!there.ok() || (!there->empty() && !read_camera_json(*there, path).ok())) {
      return invalid_argument(
          "--save-camera {}: this file exists and is not a camera. It was not changed: choose another name", path);
    }
  }
  return write_file_atomically(path, as_byte_view(write_camera_json(camera)));
}

Result<ExitCode> check(const Console& console, const CheckOptions& options, Signals& signals) {
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, load_scene(options.scene, signals));
  const Result<SceneReport> report = report_on(loaded);
  if (!report.ok()) {
    return as_input_error(report.status());
  }
  if (!options.save_camera.empty()) {
    LM_RETURN_IF_ERROR(save_camera(options.save_camera, loaded.scene.camera));
  }
  console.object(report_json(loaded, *report));
  print(console, loaded, *report);
  return kDone;
}

}  // namespace

void add_check_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand("check",
                                         "Check a scene: show its contents or its errors, and which methods find all "
                                         "its light. Needs no farm.");
  add_scene_options(*command, options->scene);
  command->add_option("--save-camera", options->save_camera, "write the scene's camera to a file for --camera")
      ->type_name("FILE");
  add_json_option(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return check(console, *options, context.signals); };
  });
}

}  // namespace lightmill::cli
