#include "common/scene_io/scene_report.h"

#include <set>

#include "common/base/number_text.h"
#include "common/methods/spec/method_spec.h"
#include "common/scene/mesh.h"
#include "common/scene/meter_reading.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/picture_notices.h"

namespace lightmill {
namespace {

// In the order of the document's variants.
constexpr std::array kLightKinds{"point", "directional", "spot", "cosine_power", "disk", "ies", "environment"};
static_assert(kLightKinds.size() == std::variant_size_v<decltype(Light::kind)>);
constexpr std::array kMaterialKinds{"diffuse",   "mirror",     "dielectric",     "phong",
                                    "conductor", "principled", "shadow_catcher", "mixture"};
static_assert(kMaterialKinds.size() == std::variant_size_v<decltype(Material::kind)>);

bool emits(const Material& material) {
  return material.emission != RgbColor{};
}

Status count(const LoadedScene& loaded, SceneReport& report) {
  std::map<Sha256, std::size_t> triangles;
  std::set<Sha256> colored;
  for (const auto& [digest, bytes] : loaded.assets) {
    report.asset_bytes += bytes.size();
  }
  for (const Object& object : loaded.scene.objects) {
    if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
      const auto [found, added] = triangles.try_emplace(mesh->asset);
      if (added) {
        LM_ASSIGN_OR_RETURN(const Mesh decoded, decode_mesh(as_byte_view(loaded.assets.at(mesh->asset))));
        found->second = decoded.triangles.size();
        if (!decoded.colors.empty()) {
          colored.insert(mesh->asset);
        }
      }
      report.colored_objects += colored.contains(mesh->asset) ? 1 : 0;
      report.triangles += found->second;
    } else {
      report.spheres += std::holds_alternative<SphereShape>(object.shape) ? 1 : 0;
      report.planes += std::holds_alternative<PlaneShape>(object.shape) ? 1 : 0;
      report.triangles += std::holds_alternative<TriangleShape>(object.shape) ? 1 : 0;
    }
    report.emissive_objects += emits(loaded.scene.materials[object.material]) ? 1 : 0;
  }
  for (const Light& light : loaded.scene.lights) {
    const auto* const disk = std::get_if<DiskLight>(&light.kind);
    ++report.lights[disk != nullptr ? disk->kind_name() : kLightKinds[light.kind.index()]];
  }
  for (const Material& material : loaded.scene.materials) {
    ++report.materials[kMaterialKinds[material.kind.index()]];
  }
  return ok_status();
}

std::string counts_text(std::string text, const SceneReport::Counts& counts) {
  for (const auto& [kind, number] : counts) {
    text += fmt::format("{}{} {}", text.ends_with(": ") ? "" : ", ", number, kind);
  }
  return text;
}

std::string point_text(const Point3d& point) {
  return fmt::format("({:g}, {:g}, {:g})", point[0], point[1], point[2]);
}

std::vector<std::string> plan_notices(const SceneFacts& facts) {
  if (!facts.lossless) {
    return {};
  }
  return {"no surface or medium absorbs one of the colour channels: in a closed room paths end only at --max-bounces"};
}

}  // namespace

Result<SceneReport> report_on(LoadedScene& loaded) {
  SceneReport report;
  LM_RETURN_IF_ERROR(count(loaded, report));
  append_notices(picture_notices(loaded, true, kDefaultBounces), loaded.notices);
  const MeshSource meshes{[&](const Sha256& digest) -> std::optional<std::string> {
    const auto found = loaded.assets.find(digest);
    return found != loaded.assets.end() && found->second.size() <= MeshSource::kMaxBytes ? std::optional(found->second)
                                                                                         : std::nullopt;
  }};
  report.facts = read_facts(loaded.scene, meshes);
  append_notices(plan_notices(report.facts), loaded.notices);
  return report;
}

ReportRows scene_rows(const LoadedScene& loaded, const SceneReport& report) {
  const Scene& scene = loaded.scene;
  ReportRows rows{
      {"scene", scene.name},
      {"film", fmt::format("{}x{} pixels", scene.film.width, scene.film.height)},
      {"camera", fmt::format("at {}, looking at {}, vertical field of view {:.4g}°", point_text(scene.camera.eye),
                             point_text(scene.camera.look_at), scene.camera.vertical_fov_degrees)},
      {"materials", counts_text(fmt::format("{}: ", scene.materials.size()), report.materials)},
      {"objects", fmt::format("{}: {}, {}, {}", scene.objects.size(), counted(report.triangles, "triangle"),
                              counted(report.spheres, "sphere"), counted(report.planes, "plane"))},
      {"lights",
       counts_text(report.emissive_objects == 1 ? "1 object that emits"
                                                : fmt::format("{} objects that emit", report.emissive_objects),
                   report.lights)}};
  if (const std::vector<std::string> groups = light_groups_of(scene); !groups.empty()) {
    rows.push_back({"light groups", fmt::format("{}", fmt::join(groups, ", "))});
  }
  if (report.colored_objects > 0) {
    rows.push_back({"vertex colours", counted(report.colored_objects, "object")});
  }
  if (!scene.textures.empty()) {
    rows.push_back({"textures", std::to_string(scene.textures.size())});
  }
  for (const Meter& meter : scene.meters) {
    rows.push_back({"meter", fmt::format("{}: {}", meter.name, quantity_of(meter))});
  }
  rows.push_back({"to send", fmt::format("{} (files of the scene), {} in all", counted(loaded.assets.size(), "asset"),
                                         human_bytes(report.asset_bytes))});
  return rows;
}

ReportRows fact_rows(const SceneFacts& facts) {
  ReportRows rows{{"casters", facts.casters.text()},
                  {"largest albedo", fmt::format("{:.3g}", facts.largest_albedo)},
                  {"features", fmt::format("{}", fmt::join(features_of(facts), ", "))}};
  if (!facts.see_through.empty()) {
    rows.push_back({"see-through", facts.see_through.text()});
  }
  if (!facts.smooth_layers.empty()) {
    rows.push_back({"smooth layers", facts.smooth_layers.text()});
  }
  return rows;
}

}  // namespace lightmill
