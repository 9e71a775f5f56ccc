// From the files that a user names to a scene and the assets that it needs.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/scene/document.h"
#include "common/scene_io/mtl.h"
#include "common/scene_io/scene_files.h"

namespace lightmill {

/// One of several cameras that a file has.
struct NamedCamera {
  std::string name;
  Camera camera;
  std::optional<double> aspect;  ///< width by height of the film that it is meant for
};

/// An image file among a scene's assets, kept as it is: a worker will decode it.
struct ImageAsset {
  Sha256 asset{};
  std::string name;          ///< for messages
  std::string place;         ///< where the scene names it, for errors
  bool environment = false;  ///< or a texture
};

/// A scene that is ready to be packed and sent.
struct LoadedScene {
  Scene scene;                           ///< valid; every mesh has its asset
  std::map<Sha256, std::string> assets;  ///< encoded meshes, and files as they are
  std::vector<ImageAsset> images;        ///< as they are named, a file perhaps often; not looked into
  std::vector<std::string> notices;      ///< what was assumed or left out, for people
  std::vector<NamedCamera> cameras;      ///< that the file has; the first is the scene's if none was asked for
};

/// Looks through a camera: its view, and the film's width where it says one.
void use_camera(const NamedCamera& camera, Scene& scene);

/// A file's ending in lower case, as ".json"; empty if it has none.
std::string lower_ending(const std::filesystem::path& path);

struct LoadOptions {
  /// Replaces the scene's camera: the name of one of the file's cameras, else a JSON file that holds one.
  std::string camera;
  KaMeaning ka = KaMeaning::automatic;
  bool light_the_dark = true;                  ///< a glTF file in which nothing emits light gets an even white sky
  const SceneFiles* files = &files_on_disk();  ///< all that can be read; outlives the call
};

/// Loads one scene document (.json, or its name without that ending), whose meshes are OBJ files relative to it; or one
/// or several OBJ files with their MTL files, seen by the course's Cornell camera: eye (277, 275, −570), to (277, 275,
/// 0), camera constant 1, 512×512; or one glTF file (.gltf, .glb; gltf/gltf.h). Errors name file and line or field;
/// nothing is returned unless all is well. Files may name others anywhere: they are read from `files` (on disk: with
/// the user's own rights), and sizes are bounded.
Result<LoadedScene> load_scene(std::span<const std::filesystem::path> paths, const LoadOptions& options = {});

}  // namespace lightmill
