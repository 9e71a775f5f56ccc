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

namespace lightmill {

/// A scene that is ready to be packed and sent.
struct LoadedScene {
  Scene scene;                           ///< valid; every mesh has its asset
  std::map<Sha256, std::string> assets;  ///< encoded meshes, and files as they are
  std::vector<std::string> notices;      ///< what was assumed or left out, for people
};

struct LoadOptions {
  std::optional<std::filesystem::path> camera_file;  ///< replaces the scene's camera
  KaMeaning ka = KaMeaning::automatic;
};

/// Loads one scene document (.json, or its name without that ending), whose meshes are OBJ files relative to it; or one
/// or several OBJ files with their MTL files, seen by the course's Cornell camera: eye (277, 275, −570), to (277, 275,
/// 0), camera constant 1, 512×512. Errors name file and line or field; nothing is returned unless all is well.
/// Documents may name files anywhere: they are read with the user's own rights, and sizes are bounded.
Result<LoadedScene> load_scene(std::span<const std::filesystem::path> paths, const LoadOptions& options = {});

}  // namespace lightmill
