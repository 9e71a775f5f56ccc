#include "common/scene_io/load.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/film/tile_grid.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/gltf/gltf.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/missing_parts.h"
#include "common/scene_io/mitsuba/mitsuba.h"
#include "common/scene_io/pbrt/pbrt.h"
#include "common/wire/scene_json.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kExpected =
    "a scene document (.json), Wavefront files (.obj), a glTF file (.gltf, .glb), a mesh (.ply, .stl), a pbrt scene "
    "(.pbrt), a Mitsuba scene (.xml) or a .blend file is expected";
/// Endings of the files that are read here.
constexpr std::array<std::string_view, 8> kEndings{".json", ".obj", ".gltf", ".glb", ".ply", ".stl", ".pbrt", ".xml"};

bool is_gltf(const fs::path& path) {
  return lower_ending(path) == ".gltf" || lower_ending(path) == ".glb";
}

Result<fs::path> resolve(const fs::path& path, const SceneFiles& files) {
  const fs::path with_ending = path.string() + ".json";
  if (lower_ending(path) != ".json" && !files.is_file(path) && files.is_file(with_ending)) {
    return with_ending;
  }
  if (!files.exists(path)) {
    return not_found("{}: no such file", path.string());
  }
  if (!files.is_file(path)) {
    return invalid_argument("{} is not a file: {}", path.string(), kExpected);
  }
  if (std::ranges::find(kEndings, lower_ending(path)) == kEndings.end()) {
    return invalid_argument("{}: {}", path.string(), kExpected);
  }
  return path;
}

/// Reads the scene in a file of at most `most_bytes`, and the files that it names.
template <class Read>
Result<LoadedScene> load_with(const Read& read, const fs::path& path, std::uint64_t most_bytes,
                              const SceneFiles& files) {
  LM_ASSIGN_OR_RETURN(std::string bytes, files.read(path, most_bytes));
  if (bytes.empty()) {
    return invalid_argument("{}: the file is empty", path.string());
  }
  LM_ASSIGN_OR_RETURN(LoadedScene loaded,
                      read(std::move(bytes), path.string(), files_below(path.parent_path(), files, kMaxFileBytes)));
  loaded.scene.name = utf8_text(path.stem().string());
  return loaded;
}

Result<LoadedScene> load_files(const std::vector<fs::path>& paths, const LoadOptions& options) {
  const SceneFiles& files = *options.files;
  if (lower_ending(paths[0]) == ".json") {
    return load_document(paths[0], files);
  }
  if (lower_ending(paths[0]) == ".pbrt") {
    return load_with(read_pbrt, paths[0], kMaxFileBytes, files);
  }
  if (lower_ending(paths[0]) == ".xml") {
    return load_with(read_mitsuba, paths[0], kMaxDocumentBytes, files);
  }
  const bool add_sky_if_unlit = options.sky == SkyChoice::automatic;
  if (lower_ending(paths[0]) == ".ply" || lower_ending(paths[0]) == ".stl") {
    return load_mesh_file(paths[0], add_sky_if_unlit, files);
  }
  const auto read = [&](std::string bytes, const std::string& name, FileSource named) {
    return read_gltf(
        std::move(bytes), name,
        {.moment = options.moment, .add_sky_if_unlit = add_sky_if_unlit, .decode_mesh = options.decode_mesh},
        std::move(named));
  };
  return is_gltf(paths[0]) ? load_with(read, paths[0], kMaxFileBytes, files)
                           : load_objs(paths, options.ka, add_sky_if_unlit, files);
}

std::string names_of(const std::vector<NamedCamera>& cameras) {
  std::string text;
  for (const NamedCamera& camera : cameras) {
    text += (text.empty() ? "" : ", ") + camera.name;
  }
  return text;
}

Status add_wanted_sky(LoadedScene& loaded) {
  for (const Light& light : loaded.scene.lights) {
    if (std::holds_alternative<EnvironmentLight>(light.kind)) {
      return invalid_argument("--sky on: the scene has the environment \"{}\", and a scene can have only one",
                              light.name);
    }
  }
  add_uniform_sky(loaded);
  return ok_status();
}

}  // namespace

std::string lower_ending(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return ending;
}

void use_camera(const NamedCamera& camera, Scene& scene) {
  scene.camera = camera.camera;
  if (camera.aspect) {
    const double width = std::round(scene.film.height * *camera.aspect);
    scene.film.width = static_cast<int>(std::clamp(width, 1.0, static_cast<double>(kMaxFilmSide)));
  }
}

Status choose_camera(const std::string& wanted, const SceneFiles& files, LoadedScene& loaded) {
  for (const NamedCamera& camera : loaded.cameras) {
    if (camera.name == wanted) {
      use_camera(camera, loaded.scene);
      return ok_status();
    }
  }
  if (const std::optional<std::int64_t> number = parse_number<std::int64_t>(wanted)) {
    const auto count = static_cast<std::int64_t>(loaded.cameras.size());
    if (*number < 1 || *number > count) {
      return invalid_argument("--camera {}: the scene has {}{}. Give the number or name of one, a camera file, or auto",
                              wanted, counted(loaded.cameras.size(), "camera"),
                              loaded.cameras.empty() ? "" : fmt::format(": {}", names_of(loaded.cameras)));
    }
    use_camera(loaded.cameras[static_cast<std::size_t>(*number - 1)], loaded.scene);
    return ok_status();
  }
  if (wanted == "auto") {
    return use_automatic_camera(loaded);
  }
  const Result<std::string> text = files.read(wanted, kMaxDocumentBytes);
  if (!text.ok()) {
    return make_error(text.status().code(), "--camera {}: the scene has no camera of this name{}. As a file: {}",
                      wanted, loaded.cameras.empty() ? "" : fmt::format(". Its cameras: {}", names_of(loaded.cameras)),
                      message_of(text.status()));
  }
  LM_ASSIGN_OR_RETURN(loaded.scene.camera, read_camera_json(*text, wanted));
  return ok_status();
}

Result<LoadedScene> load_scene(std::span<const fs::path> paths, const LoadOptions& options) {
  if (paths.empty()) {
    return invalid_argument("{}, got none", kExpected);
  }
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    LM_ASSIGN_OR_RETURN(fs::path file, resolve(path, *options.files));
    files.push_back(std::move(file));
  }
  const bool all_objs =
      std::all_of(files.begin(), files.end(), [](const fs::path& file) { return lower_ending(file) == ".obj"; });
  if (files.size() > 1 && !all_objs) {
    return invalid_argument(
        "one scene document, one glTF file, one mesh, one pbrt or Mitsuba scene or any number of .obj files are "
        "expected, got {} files that are not all .obj",
        files.size());
  }
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, load_files(files, options));
  if (!options.camera.empty()) {
    LM_RETURN_IF_ERROR(choose_camera(options.camera, *options.files, loaded));
    std::erase(loaded.notices, kCameraWasAdded);
  }
  if (options.sky == SkyChoice::on) {
    LM_RETURN_IF_ERROR(add_wanted_sky(loaded));
  }
  LM_RETURN_IF_ERROR(validate(loaded.scene));
  if (options.strict) {
    LM_RETURN_IF_ERROR(with_context(loaded.faults.as_error(), "--strict"));
  }
  const std::vector<std::string> faults = loaded.faults.notices();
  loaded.notices.insert(loaded.notices.begin(), faults.begin(), faults.end());
  return loaded;
}

}  // namespace lightmill
