#include "common/base/text.h"
#include "common/lights/ies_profile.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/obj.h"
#include "common/scene_io/tiles.h"
#include "common/wire/scene_json.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

/// Replaces the meshes of a draft by assets. An object that names its material stays one object. Others become one
/// object per material of their file.
class DocumentLoader {
 public:
  DocumentLoader(const fs::path& path, SceneFile file, const SceneFiles& files)
      : folder_(path.parent_path()), file_(std::move(file)), sources_(files) {}

  Result<LoadedScene> load() {
    const std::vector<Object> objects = std::move(file_.draft.scene.objects);
    loaded_.scene = std::move(file_.draft.scene);
    loaded_.scene.objects.clear();
    for (std::size_t i = 0; i < loaded_.scene.materials.size(); ++i) {
      materials_.try_emplace(loaded_.scene.materials[i].name, static_cast<std::uint32_t>(i));
    }
    const std::size_t textures = loaded_.scene.textures.size();  // tiles add more
    for (std::size_t i = 0; i < textures; ++i) {
      LM_RETURN_IF_ERROR(add_texture(i));
    }
    for (std::size_t i = 0; i < objects.size(); ++i) {
      LM_RETURN_IF_ERROR(add_object(i, objects[i]));
    }
    for (std::size_t i = 0; i < loaded_.scene.lights.size(); ++i) {
      LM_RETURN_IF_ERROR(add_light_file(i, loaded_.scene.lights[i]));
    }
    LM_RETURN_IF_ERROR(file_.source.located(validate(loaded_.scene)));
    LM_RETURN_IF_ERROR(file_.source.located(check_powers(loaded_.scene, loaded_.assets)));
    return std::move(loaded_);
  }

 private:
  std::string place_of(const std::string& field) const {
    return fmt::format("{}: {}", file_.source.place(field), field);
  }

  Status add_texture(std::size_t index) {
    TextureImage& texture = loaded_.scene.textures[index];
    const ImageAsset image{.name = texture.file, .place = place_of(fmt::format("textures[{}].file", index))};
    if (names_tiles(texture.file) && texture.tile == 0) {
      return add_tiles(sources_, folder_ / texture.file, static_cast<std::uint32_t>(index), image, loaded_);
    }
    LM_ASSIGN_OR_RETURN(texture.asset, add_image_file(sources_, folder_ / texture.file, image, loaded_));
    return ok_status();
  }

  Status add_object(std::size_t index, const Object& object) {
    const auto* shape = std::get_if<MeshShape>(&object.shape);
    if (shape == nullptr) {
      return keep(object);
    }
    const std::string field = fmt::format("objects[{}].mesh.file", index);
    const fs::path path = folder_ / shape->file;
    const auto [found, added] = files_.try_emplace(path.string());
    if (added) {
      LM_ASSIGN_OR_RETURN(found->second, with_context(read_obj_file(sources_, path, loaded_.faults), place_of(field)));
      append_notices(found->second.notices, loaded_.notices);
    }
    const ObjFile& file = found->second;
    if (!file_.draft.material_by_face[index]) {
      return add_parts(object, object.material, object.name, file, file.parts);
    }
    for (const ObjPart& part : file.parts) {
      Result<std::uint32_t> material = material_of(part, path, field);
      if (!material.ok()) {
        return material.status();
      }
      const std::string name = object.name.empty() ? part.material : object.name + "/" + part.material;
      LM_RETURN_IF_ERROR(add_parts(object, *material, name, file, {&part, 1}));
    }
    return ok_status();
  }

  /// Adds the file that a light names.
  Status add_light_file(std::size_t index, Light& light) {
    if (auto* ies = std::get_if<IesLight>(&light.kind)) {
      const std::string field = fmt::format("lights[{}].ies.file", index);
      const fs::path path = folder_ / ies->file;
      LM_ASSIGN_OR_RETURN(std::string text, with_context(sources_.read(path, kMaxIesBytes), place_of(field)));
      LM_ASSIGN_OR_RETURN(const IesProfile profile, with_context(read_ies(text, path.string()), place_of(field)));
      for (const std::string& notice : profile.notices) {
        loaded_.notices.push_back(fmt::format("{}: {}: {}", place_of(field), path.string(), notice));
      }
      ies->asset = add_bytes(std::move(text), loaded_);
    } else if (auto* environment = std::get_if<EnvironmentLight>(&light.kind);
               environment != nullptr && environment->has_image) {
      const std::string field = fmt::format("lights[{}].environment.file", index);
      LM_ASSIGN_OR_RETURN(environment->asset, add_image_file(sources_, folder_ / environment->file,
                                                             {.name = environment->file,
                                                              .place = place_of(field),
                                                              .environment = true,
                                                              .equal_area = environment->equal_area},
                                                             loaded_));
    }
    return ok_status();
  }

  Status add_parts(const Object& object, std::uint32_t material, const std::string& name, const ObjFile& file,
                   std::span<const ObjPart> parts) {
    MeshShape shape = std::get<MeshShape>(object.shape);
    const auto [known, added] = meshes_.try_emplace({parts.data(), parts.size()});
    if (added) {
      std::vector<const ObjPart*> all;
      for (const ObjPart& part : parts) {
        all.push_back(&part);
      }
      LM_ASSIGN_OR_RETURN(known->second, add_mesh(make_mesh(file, all), loaded_));
    }
    shape.asset = known->second;
    return keep({name, material, shape, object.transform});
  }

  Status keep(Object object) {
    const Status added = lightmill::add_object(std::move(object), loaded_);
    return added.ok() ? ok_status() : with_context(added, file_.source.place("objects"));
  }

  Result<std::uint32_t> material_of(const ObjPart& part, const fs::path& path, const std::string& field) const {
    const auto found = materials_.find(part.material);
    if (found != materials_.end()) {
      return found->second;
    }
    if (part.material.empty()) {
      return invalid_argument("{}: {} has faces before its first usemtl, and the object names no material",
                              place_of(field), path.string());
    }
    return invalid_argument("{}: {}: {}:{}: {}", file_.source.place(field), field, path.string(), part.line,
                            describe_unknown_material(part.material, loaded_.scene.materials));
  }

  fs::path folder_;
  SceneFile file_;
  const SceneFiles& sources_;
  LoadedScene loaded_;
  std::map<std::string, std::uint32_t> materials_;  ///< by name
  std::map<std::string, ObjFile> files_;
  std::map<std::pair<const ObjPart*, std::size_t>, Sha256> meshes_;  ///< by first part and number of parts
};

/// Adds the name of the folder's script to the error of a missing file, if there is one. The script fetches files that
/// are not in the repository, as in `scenes`.
Status name_fetcher(const Status& status, const fs::path& folder, const SceneFiles& files) {
  const fs::path script = folder / "get-models";
  if (status.code() != StatusCode::kNotFound || !files.is_file(script)) {
    return status;
  }
  return not_found("{}. Run {} to fetch the models", message_of(status), script.string());
}

}  // namespace

Result<LoadedScene> load_document(const fs::path& path, const SceneFiles& files) {
  LM_ASSIGN_OR_RETURN(const std::string text, files.read(path, kMaxDocumentBytes));
  LM_ASSIGN_OR_RETURN(SceneFile file, read_scene_json(text, path.string()));
  Result<LoadedScene> loaded = DocumentLoader(path, std::move(file), files).load();
  if (!loaded.ok()) {
    return name_fetcher(loaded.status(), path.parent_path(), files);
  }
  if (loaded->scene.name.empty()) {
    loaded->scene.name = utf8_text(path.stem().string());
  }
  return loaded;
}

}  // namespace lightmill
