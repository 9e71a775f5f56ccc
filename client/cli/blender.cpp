#include "client/cli/blender.h"

#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "client/cli/child_process.h"
#include "common/base/file.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/missing_parts.h"
#include "common/scene_io/text_lines.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

/// Run as `blender --background scene.blend --python FILE -- OUT.glb REPORT.json`. It writes the scene with modifiers
/// applied and area lights as emissive faces. It also writes a report: {"width", "height", "camera", "sky": [r, g, b],
/// "left_out": ["…"]}.
constexpr std::string_view kBlenderScript = R"python(
import json
import math
import sys

import bpy

glb, report_file = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
left_out = []


def leave_out(what):
    if what not in left_out:
        left_out.append(what)


def sky_color():
    """The world's radiance where it is the same from everywhere, as Cycles takes it."""
    world = scene.world
    if world is None:
        return [0, 0, 0]
    if not world.use_nodes:
        return list(world.color)
    output = next((n for n in world.node_tree.nodes if n.type == "OUTPUT_WORLD" and n.is_active_output), None)
    if output is None or not output.inputs["Surface"].is_linked:
        return [0, 0, 0]
    if output.inputs["Volume"].is_linked:
        leave_out("the world's volume")
    node = output.inputs["Surface"].links[0].from_node
    if node.type != "BACKGROUND" or node.inputs["Strength"].is_linked:
        leave_out("the world's nodes: its sky is black")
        return [0, 0, 0]
    if node.inputs["Color"].is_linked:
        leave_out("the image or nodes that colour the world: its sky is black")
        return [0, 0, 0]
    return [node.inputs["Strength"].default_value * c for c in node.inputs["Color"].default_value[:3]]


def area_as_mesh(light):
    """A face that emits along -z what Cycles' area light of this size does."""
    data = light.data
    width = data.size
    height = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else width
    if data.shape in ("DISK", "ELLIPSE"):
        turns = [2 * math.pi * i / 64 for i in range(64)]
        corners = [(width / 2 * math.cos(a), -height / 2 * math.sin(a), 0) for a in turns]
        area = math.pi * width * height / 4
    else:
        corners = [(-width / 2, -height / 2, 0), (-width / 2, height / 2, 0), (width / 2, height / 2, 0),
                   (width / 2, -height / 2, 0)]
        area = width * height
    # The light's scale stretches its face. Cycles keeps the power.
    scale = light.matrix_world.to_scale()
    area *= abs(scale.x * scale.y)
    mesh = bpy.data.meshes.new(light.name)
    mesh.from_pydata(corners, [], [range(len(corners))])
    material = bpy.data.materials.new(light.name)
    material.use_nodes = True
    material.use_backface_culling = True
    nodes = material.node_tree.nodes
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*data.color, 1)
    emission.inputs["Strength"].default_value = data.energy / (4 * area) if area > 0 else 0
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    stand_in = bpy.data.objects.new(light.name, mesh)
    stand_in.matrix_world = light.matrix_world
    scene.collection.objects.link(stand_in)


def shows_colors(material):
    return material.use_nodes and any(n.type in ("VERTEX_COLOR", "ATTRIBUTE") for n in material.node_tree.nodes)


def drop_unused_colors(item):
    """Blender shows colours of vertices only through nodes. In glTF they always multiply the base colour."""
    if item.type != "MESH" or item.data.library is not None:
        return
    if not any(slot.material and shows_colors(slot.material) for slot in item.material_slots):
        for name in [attribute.name for attribute in item.data.color_attributes]:
            item.data.color_attributes.remove(item.data.color_attributes[name])


def look_at_object(item):
    if item.hide_render:
        return
    drop_unused_colors(item)
    if item.type == "LIGHT" and item.data.type == "AREA":
        area_as_mesh(item)
    elif item.type == "LIGHT":
        if item.data.use_nodes:
            leave_out(f"the nodes of light {item.name}")
        if (item.data.angle if item.data.type == "SUN" else item.data.shadow_soft_size) > 0:
            leave_out(f"the size of light {item.name}: its shadows are sharp")
    elif item.type in ("META", "VOLUME", "GPENCIL", "POINTCLOUD", "CURVES"):
        leave_out(f"object {item.name} ({item.type.lower()})")
    elif item.type == "CAMERA" and item == scene.camera and item.data.dof.use_dof:
        leave_out("depth of field")
    if any(modifier.type == "PARTICLE_SYSTEM" for modifier in item.modifiers):
        leave_out(f"particles and hair of {item.name}")


def look_at_material(material):
    if not material.use_nodes:
        return
    output = next((n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)
    if output is None or not output.inputs["Surface"].is_linked:
        return
    kind = output.inputs["Surface"].links[0].from_node.type
    if kind not in ("BSDF_PRINCIPLED", "EMISSION", "BACKGROUND"):
        leave_out(f"the shader of material {material.name} ({kind.lower()}, not a principled one)")
    if output.inputs["Volume"].is_linked:
        leave_out(f"the volume of material {material.name}")
    if output.inputs["Displacement"].is_linked:
        leave_out(f"the displacement of material {material.name}")


for item in list(scene.objects):
    look_at_object(item)
for material in {slot.material for item in scene.objects for slot in item.material_slots if slot.material}:
    look_at_material(material)
if scene.use_nodes:
    leave_out("compositing")
bpy.context.view_layer.update()

bpy.ops.export_scene.gltf(filepath=glb, export_format="GLB", export_cameras=True, export_lights=True, export_apply=True,
                          export_animations=False, use_renderable=True, use_active_scene=True)
percent = scene.render.resolution_percentage / 100
with open(report_file, "w", encoding="utf-8") as file:
    json.dump({"width": max(1, round(scene.render.resolution_x * percent)),
               "height": max(1, round(scene.render.resolution_y * percent)),
               "camera": scene.camera.name if scene.camera else "",
               "sky": sky_color(),
               "left_out": sorted(left_out)}, file)
)python";

constexpr std::size_t kBlenderLogTail = 1000;  // bytes

/// A temporary folder, removed by the destructor.
class TemporaryFolder {
 public:
  static Result<TemporaryFolder> make() {
    std::error_code error;
    const fs::path root = fs::temp_directory_path(error);
    std::string name = ((error ? fs::path("/tmp") : root) / "lightmill-blend-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      return failed_precondition("cannot create a directory for Blender's output, {}: {}", name, std::strerror(errno));
    }
    return TemporaryFolder(name);
  }
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) {
      fs::remove_all(path_, ignored);
    }
  }
  fs::path operator/(const char* name) const { return path_ / name; }

 private:
  explicit TemporaryFolder(fs::path path) : path_(std::move(path)) {}
  fs::path path_;
};

/// The program's path.
Result<std::string> find_blender() {
  if (const char* given = std::getenv("LIGHTMILL_BLENDER"); given != nullptr && *given != '\0') {
    return std::string(given);
  }
  const char* variable = std::getenv("PATH");
  std::string_view folders = variable == nullptr ? "/usr/bin" : variable;
  while (!folders.empty()) {
    const std::size_t colon = std::min(folders.find(':'), folders.size());
    const fs::path program = fs::path(folders.substr(0, colon)) / "blender";
    if (colon > 0 && ::access(program.c_str(), X_OK) == 0) {
      return program.string();
    }
    folders.remove_prefix(std::min(colon + 1, folders.size()));
  }
  return failed_precondition(
      ".blend files need Blender, which is not installed: install it, name it in LIGHTMILL_BLENDER, or export the "
      "scene as glTF (.glb)");
}

std::string tail_of(const fs::path& log) {
  const Result<std::string> text = read_file(log);
  return !text.ok() ? "" : text->size() <= kBlenderLogTail ? *text : text->substr(text->size() - kBlenderLogTail);
}

Status run_blender(const fs::path& scene, const TemporaryFolder& folder, Signals& signals) {
  LM_ASSIGN_OR_RETURN(const std::string program, find_blender());
  LM_RETURN_IF_ERROR(write_file_atomically(folder / "export.py", as_byte_view(kBlenderScript)));
  const fs::path log = folder / "log";
  // Blender does not always remove its own temporary folder. Inside ours it is removed with ours.
  LM_ASSIGN_OR_RETURN(ChildProcess blender,
                      ChildProcess::start({"/usr/bin/env", "TMPDIR=" + (folder / "").string(), program, "--background",
                                           "--factory-startup", "--disable-autoexec", fs::absolute(scene).string(),
                                           "--python-exit-code", "3", "--python", (folder / "export.py").string(), "--",
                                           (folder / "scene.glb").string(), (folder / "report.json").string()},
                                          log));
  std::optional<std::string> end;
  while (!(end = blender.ended())) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    signals.sleep(std::chrono::milliseconds(100));
  }
  std::error_code error;
  if (*end != "exit code 0" || !fs::exists(folder / "scene.glb", error) || !fs::exists(folder / "report.json", error)) {
    return failed_precondition("{}: {} could not export the scene ({}). Its output:\n{}", scene.string(), program, *end,
                               utf8_name(tail_of(log)));
  }
  return ok_status();
}

/// The script's report about the scene.
struct Report {
  int width = 0, height = 0;
  std::string camera;
  RgbColor sky;
  std::vector<std::string> left_out;
};

Result<Report> read_report(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string text, read_file(path));
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    Report report;
    report.width = json.at("width").get<int>();
    report.height = json.at("height").get<int>();
    report.camera = json.at("camera").get<std::string>();
    const auto sky = json.at("sky").get<std::array<float, 3>>();
    report.sky = {sky[0], sky[1], sky[2]};
    report.left_out = json.at("left_out").get<std::vector<std::string>>();
    return report;
  } catch (const nlohmann::json::exception& error) {
    return internal_error("Blender's report cannot be read: {}", error.what());
  }
}

void apply(const Report& report, const LoadOptions& options, LoadedScene& loaded) {
  Scene& scene = loaded.scene;
  scene.film.width = report.width;
  scene.film.height = report.height;
  for (const NamedCamera& camera : loaded.cameras) {
    if (options.camera.empty() && camera.name == report.camera) {
      scene.camera = camera.camera;
    }
  }
  if (options.sky == SkyChoice::on) {
    add_sky(loaded);
  } else if (options.sky == SkyChoice::automatic && report.sky != RgbColor{}) {
    EnvironmentLight sky;
    sky.radiance = report.sky;
    scene.lights.push_back({"world", sky});
  }
  for (const std::string& what : report.left_out) {
    loaded.notices.push_back("left out: " + what);
  }
}

}  // namespace

Result<LoadedScene> load_blend(const fs::path& path, const LoadOptions& options, Signals& signals) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    return not_found("{}: no such file", path.string());
  }
  LM_ASSIGN_OR_RETURN(const TemporaryFolder folder, TemporaryFolder::make());
  LM_RETURN_IF_ERROR(run_blender(path, folder, signals));
  LM_ASSIGN_OR_RETURN(const Report report, read_report(folder / "report.json"));
  LoadOptions gltf_options = options;
  gltf_options.sky = SkyChoice::off;  // a Blender scene states its own world
  const std::array<fs::path, 1> glb{folder / "scene.glb"};
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, lightmill::load_scene(glb, gltf_options));
  loaded.scene.name = utf8_name(path.stem().string());
  for (ImageAsset& image : loaded.images) {
    image.place = path.string();  // the glTF file is deleted before this place is printed
  }
  apply(report, options, loaded);
  if (const Status valid = validate(loaded.scene); !valid.ok()) {
    return with_context(valid, path.string());
  }
  return loaded;
}

}  // namespace lightmill::cli
