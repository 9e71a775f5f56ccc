// Loading a scene: from the user's files to a scene and its assets.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/image/decoder/compressed_mesh.h"
#include "common/scene/document.h"
#include "common/scene_io/faults.h"
#include "common/scene_io/mtl.h"
#include "common/scene_io/scene_files.h"

namespace lightmill {

/// Whether a scene gets a uniform white sky. `automatic`: OBJ, glTF, PLY and STL files get a soft one if
/// nothing lights them (scene_light.h).
enum class SkyChoice { automatic, on, off };

/// A camera of a file.
struct NamedCamera {
  std::string name;
  Camera camera;
  std::optional<double> aspect;  ///< aspect of its film, width by height
};

/// An image file among a scene's assets, unchanged. A worker will decode it.
struct ImageAsset {
  Sha256 asset{};
  std::string name;          ///< for messages
  std::string place;         ///< place where the scene names it, for errors
  bool environment = false;  ///< or a texture
  bool equal_area = false;   ///< an environment's mapping
};

/// A scene that is ready to be packed and sent.
struct LoadedScene {
  Scene scene;                           ///< valid; every mesh has its asset
  std::map<Sha256, std::string> assets;  ///< encoded meshes, and files as they are
  std::vector<ImageAsset> images;        ///< one per mention, so a file may occur often; not decoded
  std::vector<std::string> notices;      ///< what was assumed or left out, and the faults, for people
  Faults faults;                         ///< of the files
  std::vector<NamedCamera> cameras;      ///< of the file; the first is the scene's unless another was chosen
  std::uint64_t name_bytes = 0;          ///< of the names and files of objects (add_object)
};

/// Sets the scene's camera, and the film's width if the camera has an aspect.
void use_camera(const NamedCamera& camera, Scene& scene);

/// Sets the scene's camera as `--camera` says: the name of one of `loaded.cameras`, its number from 1, `auto` for a
/// view of all, else a JSON file with a camera.
Status choose_camera(const std::string& wanted, const SceneFiles& files, LoadedScene& loaded);

/// A file's ending in lower case, as ".json". Empty if it has none.
std::string lower_ending(const std::filesystem::path& path);

/// A moment of an animation.
struct AnimationMoment {
  std::string animation;  ///< its name, or its number from 1. Empty: the first one
  double seconds = 0;
};

struct LoadOptions {
  std::string camera;  ///< replaces the scene's camera (choose_camera)
  KaMeaning ka = KaMeaning::automatic;
  SkyChoice sky = SkyChoice::automatic;
  std::optional<AnimationMoment> moment;       ///< of glTF files; none: nodes and meshes as they are modelled
  bool strict = false;                         ///< refuses files with faults
  const SceneFiles* files = &files_on_disk();  ///< the files that can be read; must outlive the call
  MeshDecoder decode_mesh = {};                ///< of glTF files; without one, compressed meshes are refused
};

/// Loads a scene from:
/// - one scene document (.json, or its name without that ending). Its meshes are OBJ files relative to it.
/// - one or several OBJ files with their MTL files, with a camera and perhaps a sky (missing_parts.h), 512×512
/// - one glTF file (.gltf, .glb; gltf/gltf.h)
/// - one pbrt scene (.pbrt; pbrt/pbrt.h)
/// - one Mitsuba scene (.xml; mitsuba/mitsuba.h)
/// Errors name the file and the line or field. There is no partial result. Faults of files other than documents are no
/// errors, unless `strict` is set. Files may name other files anywhere. These are read from `files` (on disk: with the
/// user's own rights). Sizes are limited.
Result<LoadedScene> load_scene(std::span<const std::filesystem::path> paths, const LoadOptions& options = {});

}  // namespace lightmill
