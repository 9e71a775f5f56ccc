#include "common/base/text.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/missing_parts.h"
#include "common/scene_io/ply.h"
#include "common/scene_io/stl.h"

namespace lightmill {

Result<LoadedScene> load_mesh_file(const std::filesystem::path& path, bool add_sky_if_unlit, const SceneFiles& files) {
  LoadedScene loaded;
  const std::string name = path.string();
  LM_ASSIGN_OR_RETURN(const std::string bytes, files.read(path, kMaxFileBytes));
  if (bytes.empty()) {
    return invalid_argument("{}: the file is empty", name);
  }
  LM_ASSIGN_OR_RETURN(const Mesh mesh, lower_ending(path) == ".stl" ? read_stl(bytes, name, loaded.notices)
                                                                    : read_ply(bytes, name, &loaded.notices));
  Material material;
  material.name = "default";
  const float reflectance = mesh.colors.empty() ? 0.5f : 1.0f;  // the vertices have the colours
  material.kind = DiffuseMaterial{{reflectance, reflectance, reflectance}};
  loaded.scene.materials.push_back(std::move(material));
  LM_ASSIGN_OR_RETURN(const Sha256 asset, add_mesh(mesh, loaded));
  loaded.scene.name = utf8_text(path.stem().string());
  LM_RETURN_IF_ERROR(with_context(
      add_object({loaded.scene.name, 0, MeshShape{utf8_text(path.filename().string()), asset}}, loaded), name));
  loaded.notices.push_back(fmt::format("{}: the file has no materials: it is rendered as {} diffuse", name,
                                       mesh.colors.empty() ? "grey" : "white"));
  add_missing_camera(loaded);
  if (add_sky_if_unlit) {
    add_missing_light(loaded);
  }
  return loaded;
}

}  // namespace lightmill
