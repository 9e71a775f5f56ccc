#include "common/scene_io/load.h"

#include <cmath>
#include <numbers>
#include <set>

#include "common/base/file.h"
#include "common/scene/mesh.h"
#include "common/scene_io/obj.h"
#include "common/scene_io/text_lines.h"
#include "common/wire/scene_json.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMaxDocumentBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMaxObjBytes = std::uint64_t{4} << 30;

Result<ObjFile> load_obj(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMaxObjBytes));
  return read_obj(text, path.string());
}

/// Encodes a mesh of some parts and keeps it among the assets.
Result<Sha256> add_mesh(const ObjFile& file, std::span<const ObjPart* const> parts, LoadedScene& loaded) {
  const Mesh mesh = make_mesh(file, parts);
  LM_RETURN_IF_ERROR(validate(mesh));
  std::string bytes = encode_mesh(mesh);
  const Sha256 digest = sha256(bytes);
  loaded.assets.try_emplace(digest, std::move(bytes));
  return digest;
}

void append(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

// ---- scene documents ----

/// Replaces the meshes of a draft by assets: one object stays one object if it names its material, else becomes one per
/// material of its file.
class DocumentLoader {
 public:
  DocumentLoader(const fs::path& path, SceneFile file) : folder_(path.parent_path()), file_(std::move(file)) {}

  Result<LoadedScene> load() {
    const std::vector<Object> objects = std::move(file_.draft.scene.objects);
    loaded_.scene = std::move(file_.draft.scene);
    loaded_.scene.objects.clear();
    for (std::size_t i = 0; i < objects.size(); ++i) {
      LM_RETURN_IF_ERROR(add_object(i, objects[i]));
    }
    return std::move(loaded_);
  }

 private:
  Status add_object(std::size_t index, const Object& object) {
    const auto* shape = std::get_if<MeshShape>(&object.shape);
    if (shape == nullptr) {
      loaded_.scene.objects.push_back(object);
      return ok_status();
    }
    const std::string field = fmt::format("objects[{}].mesh.file", index);
    const fs::path path = folder_ / shape->file;
    const auto [found, added] = files_.try_emplace(path.string());
    if (added) {
      Result<ObjFile> file = load_obj(path);
      if (!file.ok()) {
        return with_context(file.status(), fmt::format("{}: {}", file_.source.place(field), field));
      }
      found->second = *std::move(file);
      append(loaded_.notices, found->second.notices);
    }
    const ObjFile& file = found->second;
    if (!file_.draft.material_by_face[index]) {
      std::vector<const ObjPart*> parts;
      for (const ObjPart& part : file.parts) {
        parts.push_back(&part);
      }
      return add_part(object, object.material, object.name, file, parts);
    }
    for (const ObjPart& part : file.parts) {
      Result<std::uint32_t> material = material_of(part, path, field);
      if (!material.ok()) {
        return material.status();
      }
      const std::array<const ObjPart*, 1> parts{&part};
      const std::string name = object.name.empty() ? part.material : object.name + "/" + part.material;
      LM_RETURN_IF_ERROR(add_part(object, *material, name, file, parts));
    }
    return ok_status();
  }

  Status add_part(const Object& object, std::uint32_t material, const std::string& name, const ObjFile& file,
                  std::span<const ObjPart* const> parts) {
    MeshShape shape = std::get<MeshShape>(object.shape);
    LM_ASSIGN_OR_RETURN(shape.asset, add_mesh(file, parts, loaded_));
    loaded_.scene.objects.push_back({name, material, shape});
    return ok_status();
  }

  Result<std::uint32_t> material_of(const ObjPart& part, const fs::path& path, const std::string& field) const {
    const std::vector<Material>& materials = loaded_.scene.materials;
    for (std::size_t i = 0; i < materials.size(); ++i) {
      if (materials[i].name == part.material) {
        return static_cast<std::uint32_t>(i);
      }
    }
    if (part.material.empty()) {
      return invalid_argument("{}: {}: {} has faces before its first usemtl, and the object names no material",
                              file_.source.place(field), field, path.string());
    }
    return invalid_argument("{}:{}: {}", path.string(), part.line, describe_unknown_material(part.material, materials));
  }

  fs::path folder_;
  SceneFile file_;
  LoadedScene loaded_;
  std::map<std::string, ObjFile> files_;
};

Result<LoadedScene> load_document(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMaxDocumentBytes));
  LM_ASSIGN_OR_RETURN(SceneFile file, read_scene_json(text, path.string()));
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, DocumentLoader(path, std::move(file)).load());
  if (loaded.scene.name.empty()) {
    loaded.scene.name = utf8_name(path.stem().string());
  }
  return loaded;
}

// ---- OBJ files directly ----

Camera course_cornell_camera() {
  return {{277, 275, -570}, {277, 275, 0}, {0, 1, 0}, 2 * std::atan(0.5) * 180 / std::numbers::pi};
}

/// An OBJ file and the materials that it names.
struct ObjWithMaterials {
  fs::path path;
  ObjFile obj;
  std::vector<MtlMaterial> materials;
};

Status load_libraries(ObjWithMaterials& file) {
  std::set<std::string> names;
  for (const ObjLibrary& library : file.obj.libraries) {
    const fs::path path = file.path.parent_path() / library.file;
    const Result<std::string> text = read_file(path, kMaxMtlBytes);
    if (!text.ok()) {
      return with_context(text.status(), fmt::format("{}:{}: mtllib", file.path.string(), library.line));
    }
    LM_ASSIGN_OR_RETURN(const std::vector<MtlMaterial> materials, read_mtl(*text, path.string()));
    for (const MtlMaterial& material : materials) {
      if (!names.insert(material.name).second) {
        return invalid_argument("{}:{}: newmtl: material \"{}\" is defined twice", material.file, material.line,
                                material.name);
      }
      file.materials.push_back(material);
    }
  }
  return ok_status();
}

bool same_definition(const MtlMaterial& a, const MtlMaterial& b) {
  return a.ka == b.ka && a.kd == b.kd && a.ks == b.ks && a.ke == b.ke && a.ior == b.ior && a.illum == b.illum;
}

/// The materials of all files as one list. Equal ones are shared; different ones of one name take their file's name as
/// well.
class MaterialList {
 public:
  /// Index of a file's material in the list.
  std::uint32_t add(MtlMaterial material) {
    for (int round = 1;; ++round) {
      const auto [found, added] = index_.try_emplace(material.name, all_.size());
      if (added) {
        all_.push_back(material);
      }
      if (added || same_definition(all_[found->second], material)) {
        return static_cast<std::uint32_t>(found->second);
      }
      const std::string file = utf8_name(fs::path(material.file).filename().string());
      material.name = round == 1 ? fmt::format("{} ({})", material.name, file) : fmt::format("{}'", material.name);
    }
  }
  const std::vector<MtlMaterial>& all() const { return all_; }

 private:
  std::vector<MtlMaterial> all_;
  std::map<std::string, std::size_t> index_;
};

/// The material of a part, which is added to the list.
Result<std::uint32_t> part_material(const ObjWithMaterials& file, const ObjPart& part, MaterialList& list,
                                    std::vector<std::string>& notices) {
  if (part.line == 0) {
    notices.push_back(
        fmt::format("{}: faces before the first usemtl are rendered as grey diffuse", file.path.string()));
    MtlMaterial grey;
    grey.name = "default";
    grey.file = file.path.string();
    return list.add(grey);
  }
  for (const MtlMaterial& material : file.materials) {
    if (material.name == part.material) {
      return list.add(material);
    }
  }
  std::vector<Material> known;
  for (const MtlMaterial& material : file.materials) {
    known.emplace_back().name = material.name;
  }
  return invalid_argument("{}:{}: {}", file.path.string(), part.line, describe_unknown_material(part.material, known));
}

Result<LoadedScene> load_objs(std::span<const fs::path> paths, KaMeaning ka) {
  LoadedScene loaded;
  MaterialList materials;
  for (const fs::path& path : paths) {
    ObjWithMaterials file{path, {}, {}};
    LM_ASSIGN_OR_RETURN(file.obj, load_obj(path));
    LM_RETURN_IF_ERROR(load_libraries(file));
    append(loaded.notices, file.obj.notices);
    for (const ObjPart& part : file.obj.parts) {
      LM_ASSIGN_OR_RETURN(const std::uint32_t material, part_material(file, part, materials, loaded.notices));
      const std::array<const ObjPart*, 1> parts{&part};
      LM_ASSIGN_OR_RETURN(const Sha256 asset, add_mesh(file.obj, parts, loaded));
      const std::string stem = utf8_name(path.stem().string());
      loaded.scene.objects.push_back({part.material.empty() ? stem : stem + "/" + part.material, material,
                                      MeshShape{utf8_name(path.filename().string()), asset}});
    }
    loaded.scene.name += (loaded.scene.name.empty() ? "" : "+") + utf8_name(path.stem().string());
  }
  loaded.scene.materials = map_materials(materials.all(), ka, loaded.notices);
  loaded.scene.camera = course_cornell_camera();
  return loaded;
}

Result<fs::path> resolve(const fs::path& path) {
  std::error_code error;
  const fs::path with_ending = path.string() + ".json";
  if (path.extension() != ".json" && !fs::is_regular_file(path, error) && fs::is_regular_file(with_ending, error)) {
    return with_ending;
  }
  if (!fs::exists(path, error)) {
    return not_found("{}: no such file", path.string());
  }
  if (path.extension() != ".json" && path.extension() != ".obj") {
    return invalid_argument("{}: a scene document (.json) or Wavefront files (.obj) are expected", path.string());
  }
  return path;
}

}  // namespace

Result<LoadedScene> load_scene(std::span<const fs::path> paths, const LoadOptions& options) {
  if (paths.empty()) {
    return invalid_argument("a scene document (.json) or Wavefront files (.obj) are expected, got none");
  }
  std::vector<fs::path> files;
  bool any_document = false;
  for (const fs::path& path : paths) {
    LM_ASSIGN_OR_RETURN(fs::path file, resolve(path));
    any_document = any_document || file.extension() == ".json";
    files.push_back(std::move(file));
  }
  if (any_document && files.size() > 1) {
    return invalid_argument("one scene document or any number of .obj files are expected, got {} files with a document",
                            files.size());
  }
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, any_document ? load_document(files[0]) : load_objs(files, options.ka));
  if (options.camera_file) {
    LM_ASSIGN_OR_RETURN(const std::string text, read_file(*options.camera_file, kMaxDocumentBytes));
    LM_ASSIGN_OR_RETURN(loaded.scene.camera, read_camera_json(text, options.camera_file->string()));
  }
  LM_RETURN_IF_ERROR(validate(loaded.scene));
  return loaded;
}

}  // namespace lightmill
