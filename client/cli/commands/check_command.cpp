// lightmill check SCENE
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/plan_report.h"
#include "client/cli/scene_options.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/file.h"
#include "common/base/overloaded.h"
#include "common/methods/spec/method_spec.h"
#include "common/scene/mesh.h"
#include "common/scene/meter_reading.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/load.h"
#include "common/scene_io/picture_notices.h"
#include "common/wire/scene_json.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

struct CheckOptions {
  SceneOptions scene;
  std::string save_camera;
};

using Counts = std::map<std::string, std::size_t>;

/// What there is in a scene.
struct Facts {
  std::size_t triangles = 0, spheres = 0, planes = 0, emissive_objects = 0;
  Counts lights, materials;  ///< by kind
  std::uint64_t asset_bytes = 0;
};

std::string kind_of(const Light& light) {
  return std::visit(
      Overloaded{[](const PointLight&) { return "point"; }, [](const DirectionalLight&) { return "directional"; },
                 [](const SpotLight&) { return "spot"; }, [](const CosinePowerLight&) { return "cosine_power"; },
                 [](const IesLight&) { return "ies"; }, [](const EnvironmentLight&) { return "environment"; }},
      light.kind);
}

std::string kind_of(const Material& material) {
  return std::visit(
      Overloaded{[](const DiffuseMaterial&) { return "diffuse"; }, [](const MirrorMaterial&) { return "mirror"; },
                 [](const DielectricMaterial&) { return "dielectric"; }, [](const PhongMaterial&) { return "phong"; },
                 [](const ConductorMaterial&) { return "conductor"; },
                 [](const PrincipledMaterial&) { return "principled"; },
                 [](const HoldoutMaterial&) { return "holdout"; }},
      material.kind);
}

bool emits(const Material& material) {
  return material.emission != RgbColor{};
}

Result<Facts> count(const LoadedScene& loaded) {
  Facts facts;
  std::map<Sha256, std::size_t> triangles;
  for (const auto& [digest, bytes] : loaded.assets) {
    facts.asset_bytes += bytes.size();
  }
  for (const Object& object : loaded.scene.objects) {
    if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
      const auto [found, added] = triangles.try_emplace(mesh->asset);
      if (added) {
        LM_ASSIGN_OR_RETURN(const Mesh decoded, decode_mesh(as_byte_view(loaded.assets.at(mesh->asset))));
        found->second = decoded.triangles.size();
      }
      facts.triangles += found->second;
    } else {
      facts.spheres += std::holds_alternative<SphereShape>(object.shape) ? 1 : 0;
      facts.planes += std::holds_alternative<PlaneShape>(object.shape) ? 1 : 0;
      facts.triangles += std::holds_alternative<TriangleShape>(object.shape) ? 1 : 0;
    }
    facts.emissive_objects += emits(loaded.scene.materials[object.material]) ? 1 : 0;
  }
  for (const Light& light : loaded.scene.lights) {
    ++facts.lights[kind_of(light)];
  }
  for (const Material& material : loaded.scene.materials) {
    ++facts.materials[kind_of(material)];
  }
  return facts;
}

/// `first` with the counts by kind.
json counts_json(const std::string& name, std::size_t first, const Counts& counts) {
  json out{{name, first}};
  for (const auto& [kind, number] : counts) {
    out[kind] = number;
  }
  return out;
}

std::string counts_text(std::string text, const Counts& counts) {
  for (const auto& [kind, number] : counts) {
    text += fmt::format("{}{} {}", text.ends_with(": ") ? "" : ", ", number, kind);
  }
  return text;
}

json meters_json(const std::vector<Meter>& meters) {
  json list = json::array();
  for (const Meter& meter : meters) {
    list.push_back({{"name", meter.name}, {"quantity", quantity_of(meter)}});
  }
  return list;
}

json to_json(const LoadedScene& loaded, const Facts& facts, const SceneFacts& plan) {
  const Scene& scene = loaded.scene;
  json out{{"name", scene.name},
           {"width", scene.film.width},
           {"height", scene.film.height},
           {"materials", counts_json("count", scene.materials.size(), facts.materials)},
           {"objects", scene.objects.size()},
           {"triangles", facts.triangles},
           {"spheres", facts.spheres},
           {"planes", facts.planes},
           {"lights", counts_json("emissive_objects", facts.emissive_objects, facts.lights)},
           {"light_groups", light_groups_of(scene)},
           {"textures", scene.textures.size()},
           {"meters", meters_json(scene.meters)},
           {"assets", {{"count", loaded.assets.size()}, {"bytes", facts.asset_bytes}}},
           {"camera",
            {{"eye", scene.camera.eye},
             {"look_at", scene.camera.look_at},
             {"up", scene.camera.up},
             {"vertical_fov_degrees", scene.camera.vertical_fov_degrees}}},
           {"notices", loaded.notices}};
  out.update(plan_json(plan));
  return out;
}

std::string point_text(const Point3d& point) {
  return fmt::format("({:g}, {:g}, {:g})", point[0], point[1], point[2]);
}

void print(const Console& console, const LoadedScene& loaded, const Facts& facts, const SceneFacts& plan) {
  const Scene& scene = loaded.scene;
  std::vector<std::vector<std::string>> rows{
      {"scene", scene.name},
      {"film", fmt::format("{}x{} pixels", scene.film.width, scene.film.height)},
      {"camera", fmt::format("at {}, looking at {}, {:.4g}° high", point_text(scene.camera.eye),
                             point_text(scene.camera.look_at), scene.camera.vertical_fov_degrees)},
      {"materials", counts_text(fmt::format("{}: ", scene.materials.size()), facts.materials)},
      {"objects", fmt::format("{}: {}, {}, {}", scene.objects.size(), counted(facts.triangles, "triangle"),
                              counted(facts.spheres, "sphere"), counted(facts.planes, "plane"))},
      {"lights", counts_text(facts.emissive_objects == 1 ? "1 object that emits"
                                                         : fmt::format("{} objects that emit", facts.emissive_objects),
                             facts.lights)}};
  if (const std::vector<std::string> groups = light_groups_of(scene); !groups.empty()) {
    rows.push_back({"light groups", fmt::format("{}", fmt::join(groups, ", "))});
  }
  if (!scene.textures.empty()) {
    rows.push_back({"textures", std::to_string(scene.textures.size())});
  }
  for (const Meter& meter : scene.meters) {
    rows.push_back({"meter " + meter.name, std::string(quantity_of(meter))});
  }
  rows.push_back({"assets", fmt::format("{}, {}", loaded.assets.size(), human_bytes(facts.asset_bytes))});
  print_table(console, rows);
  print_table(console, plan_rows(plan));
  for (const std::string& notice : loaded.notices) {
    console.result("note: " + notice);
  }
}

/// Replaces a camera's file, or an empty one, but no other.
Status save_camera(const std::string& path, const Camera& camera) {
  std::error_code error;
  if (std::filesystem::exists(path, error)) {
    const Result<std::string> there = read_file(path);
    if (!there.ok() || (!there->empty() && !read_camera_json(*there, path).ok())) {
      return invalid_argument("--save-camera {}: there is another file, which is no camera; it is left as it is", path);
    }
  }
  return write_file_atomically(path, as_byte_view(write_camera_json(camera)));
}

ExitCode check(const Console& console, const CheckOptions& options, Signals& signals) {
  Result<LoadedScene> loaded = load_scene(options.scene, signals);
  if (!loaded.ok()) {
    return console.fail(loaded.status());
  }
  const Result<Facts> facts = count(*loaded);
  if (!facts.ok()) {
    return console.fail(as_input_error(facts.status()));
  }
  append_notices(picture_notices(*loaded, true, kMaxBounces), loaded->notices);
  const MeshSource meshes{[&](const Sha256& digest) -> std::optional<std::string> {
    const auto found = loaded->assets.find(digest);
    return found != loaded->assets.end() && found->second.size() <= MeshSource::kMostBytes
               ? std::optional(found->second)
               : std::nullopt;
  }};
  const SceneFacts plan = read_facts(loaded->scene, meshes);
  append_notices(plan_notices(plan), loaded->notices);
  if (!options.save_camera.empty()) {
    if (const Status status = save_camera(options.save_camera, loaded->scene.camera); !status.ok()) {
      return console.fail(status);
    }
  }
  console.object(to_json(*loaded, *facts, plan));
  print(console, *loaded, *facts, plan);
  return kDone;
}

}  // namespace

void add_check_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand("check",
                                         "Read a scene, say what is in it or what is wrong with it, and which methods "
                                         "find all of its light. Needs no farm.");
  add_scene_options(*command, options->scene);
  command->add_option("--save-camera", options->save_camera, "write the scene's camera to a file for --camera")
      ->type_name("FILE")
      ->check(not_empty("a file is"));
  add_json_option(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return check(console, *options, context.signals); };
  });
}

}  // namespace lightmill::cli
