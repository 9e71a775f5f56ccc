// lightmill check SCENE
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/scene_options.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/file.h"
#include "common/base/overloaded.h"
#include "common/scene/mesh.h"
#include "common/scene_io/load.h"
#include "common/wire/scene_json.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

struct CheckOptions {
  SceneOptions scene;
  std::string save_camera;
};

/// What there is in a scene.
struct Facts {
  std::size_t triangles = 0, spheres = 0, emissive_objects = 0;
  std::map<std::string, std::size_t> lights;  ///< by kind
  std::size_t diffuse = 0, mirror = 0, dielectric = 0;
  std::uint64_t asset_bytes = 0;
};

std::string kind_of(const Light& light) {
  return std::visit(
      Overloaded{[](const PointLight&) { return "point"; }, [](const DirectionalLight&) { return "directional"; },
                 [](const SpotLight&) { return "spot"; }, [](const CosinePowerLight&) { return "cosine_power"; },
                 [](const IesLight&) { return "ies"; }, [](const EnvironmentLight&) { return "environment"; }},
      light.kind);
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
      ++facts.spheres;
    }
    facts.emissive_objects += emits(loaded.scene.materials[object.material]) ? 1 : 0;
  }
  for (const Light& light : loaded.scene.lights) {
    ++facts.lights[kind_of(light)];
  }
  for (const Material& material : loaded.scene.materials) {
    facts.diffuse += std::holds_alternative<DiffuseMaterial>(material.kind) ? 1 : 0;
    facts.mirror += std::holds_alternative<MirrorMaterial>(material.kind) ? 1 : 0;
    facts.dielectric += std::holds_alternative<DielectricMaterial>(material.kind) ? 1 : 0;
  }
  return facts;
}

json lights_json(const Facts& facts) {
  json out{{"emissive_objects", facts.emissive_objects}};
  for (const auto& [kind, number] : facts.lights) {
    out[kind] = number;
  }
  return out;
}

std::string lights_text(const Facts& facts) {
  std::string text = fmt::format("{} objects that emit", facts.emissive_objects);
  for (const auto& [kind, number] : facts.lights) {
    text += fmt::format(", {} {}", number, kind);
  }
  return text;
}

json to_json(const LoadedScene& loaded, const Facts& facts) {
  const Scene& scene = loaded.scene;
  return {{"name", scene.name},
          {"width", scene.film.width},
          {"height", scene.film.height},
          {"materials",
           {{"count", scene.materials.size()},
            {"diffuse", facts.diffuse},
            {"mirror", facts.mirror},
            {"dielectric", facts.dielectric}}},
          {"objects", scene.objects.size()},
          {"triangles", facts.triangles},
          {"spheres", facts.spheres},
          {"lights", lights_json(facts)},
          {"assets", {{"count", loaded.assets.size()}, {"bytes", facts.asset_bytes}}},
          {"camera",
           {{"eye", scene.camera.eye},
            {"look_at", scene.camera.look_at},
            {"up", scene.camera.up},
            {"vertical_fov_degrees", scene.camera.vertical_fov_degrees}}},
          {"notices", loaded.notices}};
}

std::string point_text(const Point3d& point) {
  return fmt::format("({:g}, {:g}, {:g})", point[0], point[1], point[2]);
}

void print(const Console& console, const LoadedScene& loaded, const Facts& facts) {
  const Scene& scene = loaded.scene;
  print_table(
      console,
      {{"scene", scene.name},
       {"film", fmt::format("{}x{} pixels", scene.film.width, scene.film.height)},
       {"camera", fmt::format("at {}, looking at {}, {:.4g}° high", point_text(scene.camera.eye),
                              point_text(scene.camera.look_at), scene.camera.vertical_fov_degrees)},
       {"materials", fmt::format("{}: {} diffuse, {} mirror, {} glass", scene.materials.size(), facts.diffuse,
                                 facts.mirror, facts.dielectric)},
       {"objects", fmt::format("{}: {} triangles, {} spheres", scene.objects.size(), facts.triangles, facts.spheres)},
       {"lights", lights_text(facts)},
       {"assets", fmt::format("{}, {}", loaded.assets.size(), human_bytes(facts.asset_bytes))}});
  for (const std::string& notice : loaded.notices) {
    console.result("note: " + notice);
  }
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
  if (facts->emissive_objects + loaded->scene.lights.size() == 0) {
    loaded->notices.emplace_back("nothing emits light: the picture will be black");
  }
  if (!options.save_camera.empty()) {
    const std::string text = write_camera_json(loaded->scene.camera);
    if (const Status status = write_file_atomically(options.save_camera, as_byte_view(text)); !status.ok()) {
      return console.fail(status);
    }
  }
  console.object(to_json(*loaded, *facts));
  print(console, *loaded, *facts);
  return kDone;
}

}  // namespace

void add_check_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      app.add_subcommand("check", "Read a scene, say what is in it or what is wrong with it. Needs no farm.");
  add_scene_options(*command, options->scene);
  command->add_option("--save-camera", options->save_camera, "write the scene's camera to a file for --camera")
      ->type_name("FILE");
  add_json_option(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return check(console, *options, context.signals); };
  });
}

}  // namespace lightmill::cli
