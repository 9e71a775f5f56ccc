#include "client/cli/blender.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "client/cli/child_process.h"
#include "common/base/file.h"
#include "common/base/text.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/missing_parts.h"
#include "common/wire/scene_json.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kBlenderLogTail = 1000;  // bytes

/// A temporary folder, removed by the destructor.
class TemporaryFolder {
 public:
  static Result<TemporaryFolder> make() {
    std::error_code error;
    const fs::path root = fs::temp_directory_path(error);
    std::string name = ((error ? fs::path("/tmp") : root) / "lightmill-blend-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      return failed_precondition("cannot create a folder for Blender's output, {}: {}", name, std::strerror(errno));
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
      ".blend files need Blender, which is not installed: install it (Debian's packages blender and python3-numpy), "
      "name it in LIGHTMILL_BLENDER, or export the scene as glTF (.glb)");
}

/// The system's programs come first: Blender's Python takes the libraries of the first python3. An activated environment
/// has another one.
std::string path_for_blender() {
  const char* own = std::getenv("PATH");
  return std::string("/usr/local/bin:/usr/bin:/bin") + (own == nullptr ? "" : fmt::format(":{}", own));
}

std::string tail_of(const fs::path& log) {
  const Result<std::string> text = read_file(log);
  return !text.ok() ? "" : text->size() <= kBlenderLogTail ? *text : text->substr(text->size() - kBlenderLogTail);
}

Status run_blender(const fs::path& scene, int bake_size, const TemporaryFolder& folder, Signals& signals) {
  LM_ASSIGN_OR_RETURN(const std::string program, find_blender());
  const fs::path log = folder / "log";
  // Blender does not always remove its own temporary folder. Inside ours it is removed with ours.
  LM_ASSIGN_OR_RETURN(
      ChildProcess blender,
      ChildProcess::start({"/usr/bin/env", "--unset=PYTHONHOME", "--unset=PYTHONPATH", "PATH=" + path_for_blender(),
                           "TMPDIR=" + (folder / "").string(), program, "--background", "--factory-startup",
                           "--disable-autoexec", fs::absolute(scene).string(), "--python-exit-code", "3", "--python",
                           (own_folder() / "lightmill-blender" / "run.py").string(), "--", (folder / "").string(),
                           std::to_string(bake_size)},
                          log));
  std::optional<std::string> end;
  while (!(end = blender.ended())) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    signals.sleep(std::chrono::milliseconds(100));
  }
  std::error_code error;
  if (*end != "exit code 0" || !fs::exists(folder / "report.json", error)) {
    return failed_precondition("{}: {} could not export the scene ({}). Its output:\n{}", scene.string(), program, *end,
                               utf8_text(tail_of(log)));
  }
  return ok_status();
}

/// The exporter's report beside the document.
struct Report {
  std::string camera;  ///< name of the active one; empty without one
  std::vector<NamedCamera> cameras;
  std::vector<std::string> notices;
};

Result<Report> read_report(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string text, read_file(path));
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    Report report;
    report.camera = json.at("camera").get<std::string>();
    for (const nlohmann::json& named : json.at("cameras")) {
      LM_ASSIGN_OR_RETURN(Camera camera, read_camera_json(named.at("camera").dump(), path.string()));
      report.cameras.push_back({named.at("name").get<std::string>(), std::move(camera), {}});
    }
    report.notices = json.at("notices").get<std::vector<std::string>>();
    return report;
  } catch (const nlohmann::json::exception& error) {
    return internal_error("Blender's report cannot be read: {}", error.what());
  }
}

Status choose_view(const Report& report, const LoadOptions& options, LoadedScene& loaded) {
  loaded.cameras = report.cameras;
  if (!options.camera.empty()) {
    return choose_camera(options.camera, *options.files, loaded);
  }
  return report.camera.empty() ? use_automatic_camera(loaded) : ok_status();
}

void remove_world(LoadedScene& loaded) {
  std::erase_if(loaded.scene.lights,
                [](const Light& light) { return std::holds_alternative<EnvironmentLight>(light.kind); });
  std::erase_if(loaded.images, [&](const ImageAsset& image) {
    if (image.environment && std::ranges::none_of(loaded.scene.textures, [&](const TextureImage& texture) {
          return texture.asset == image.asset;
        })) {
      loaded.assets.erase(image.asset);
    }
    return image.environment;
  });
}

void choose_sky(SkyChoice sky, LoadedScene& loaded) {
  if (sky != SkyChoice::automatic) {
    remove_world(loaded);
  }
  if (sky == SkyChoice::on) {
    add_uniform_sky(loaded);
  }
}

}  // namespace

Result<LoadedScene> load_blend(const fs::path& path, int bake_size, const LoadOptions& options, Signals& signals) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    return not_found("{}: no such file", path.string());
  }
  LM_ASSIGN_OR_RETURN(const TemporaryFolder folder, TemporaryFolder::make());
  LM_RETURN_IF_ERROR(run_blender(path, bake_size, folder, signals));
  LM_ASSIGN_OR_RETURN(const Report report, read_report(folder / "report.json"));
  LoadOptions document_options = options;
  document_options.camera.clear();
  document_options.sky = SkyChoice::off;  // a Blender scene states its own world
  const std::array<fs::path, 1> document{folder / "scene.json"};
  LM_ASSIGN_OR_RETURN(LoadedScene loaded,
                      with_context(lightmill::load_scene(document, document_options), path.string()));
  loaded.scene.name = utf8_text(path.stem().string());
  for (ImageAsset& image : loaded.images) {
    image.place = path.string();  // the document is deleted before this place is printed
  }
  LM_RETURN_IF_ERROR(choose_view(report, options, loaded));
  choose_sky(options.sky, loaded);
  loaded.notices.insert(loaded.notices.end(), report.notices.begin(), report.notices.end());
  LM_RETURN_IF_ERROR(with_context(validate(loaded.scene), path.string()));
  return loaded;
}

}  // namespace lightmill::cli
