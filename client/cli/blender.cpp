#include "client/cli/blender.h"

#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "client/cli/blender_script.h"
#include "client/cli/child_process.h"
#include "common/base/file.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/missing_parts.h"
#include "common/scene_io/text_lines.h"

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
