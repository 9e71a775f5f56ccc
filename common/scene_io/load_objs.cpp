#include <cmath>
#include <map>
#include <numbers>

#include "common/scene/validate/validate.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/obj.h"
#include "common/scene_io/text_lines.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{64} << 20;

Camera course_cornell_camera() {
  return {{277, 275, -570}, {277, 275, 0}, {0, 1, 0}, 2 * std::atan(0.5) * 180 / std::numbers::pi};
}

/// An OBJ file and the materials that it names.
struct ObjWithMaterials {
  fs::path path;
  ObjFile obj;
  std::vector<MtlMaterial> materials;
  std::map<std::string, std::size_t> by_name;  ///< index in `materials`
};

/// The files of a mtllib: one, or, if that does not exist, several with blanks between them.
std::vector<fs::path> library_files(const fs::path& folder, std::string_view written, const SceneFiles& files) {
  if (files.exists(folder / written)) {
    return {folder / written};
  }
  std::vector<fs::path> out;
  for (std::string_view word = take_word(written); !word.empty(); word = take_word(written)) {
    out.push_back(folder / word);
  }
  return out;
}

bool same_definition(const MtlMaterial& a, const MtlMaterial& b) {
  const auto definition = [](const MtlMaterial& m) {
    return std::tie(m.ka, m.kd, m.ks, m.ke, m.tf, m.ior, m.exponent, m.opacity, m.roughness, m.metallic, m.coat,
                    m.coat_roughness, m.illum, m.maps, m.unused);
  };
  return definition(a) == definition(b) &&
         (a.maps.empty() || fs::path(a.file).parent_path() == fs::path(b.file).parent_path());
}

/// Loads the libraries of a file. The first of several materials with one name counts.
Status load_libraries(ObjWithMaterials& file, const SceneFiles& files, std::vector<std::string>& notices) {
  for (const ObjLibrary& library : file.obj.libraries) {
    for (const fs::path& path : library_files(file.path.parent_path(), library.file, files)) {
      const Result<std::string> text = files.read(path, kMaxMtlBytes);
      if (!text.ok()) {
        return with_context(text.status(), fmt::format("{}:{}: mtllib", file.path.string(), library.line));
      }
      LM_ASSIGN_OR_RETURN(const std::vector<MtlMaterial> materials, read_mtl(*text, path.string()));
      for (const MtlMaterial& material : materials) {
        const auto [known, added] = file.by_name.try_emplace(material.name, file.materials.size());
        if (!added) {
          if (const MtlMaterial& first = file.materials[known->second]; !same_definition(first, material)) {
            append_notices({fmt::format("left out: {}:{}: material \"{}\", which {}:{} defines differently",
                                        material.file, material.line, material.name, first.file, first.line)},
                           notices);
          }
          continue;
        }
        file.materials.push_back(material);
      }
    }
  }
  return ok_status();
}

/// The materials of all files as one list. Equal materials are shared. Different ones with one name get their file's
/// name as well.
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
  std::vector<MtlMaterial> take() { return std::move(all_); }

 private:
  std::vector<MtlMaterial> all_;
  std::map<std::string, std::size_t> index_;
};

/// The material of a part. It is added to the list.
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
  if (const auto found = file.by_name.find(part.material); found != file.by_name.end()) {
    return list.add(file.materials[found->second]);
  }
  std::vector<Material> known;
  for (const MtlMaterial& material : file.materials) {
    known.emplace_back().name = material.name;
  }
  return invalid_argument("{}:{}: {}", file.path.string(), part.line, describe_unknown_material(part.material, known));
}

/// Paths in a file may have backslashes between folders.
std::string existing_path(std::string path, const SceneFiles& files) {
  if (!files.exists(path)) {
    std::replace(path.begin(), path.end(), '\\', '/');
  }
  return path;
}

std::string place_of(const MtlMaterial& material, const MtlMap& map) {
  return fmt::format("{}:{}: {} of material \"{}\"", material.file, map.line, map.keyword, material.name);
}

/// Leaves out maps whose file does not exist, with a notice. Downloaded models often come without their images.
void leave_out_missing_maps(std::vector<MtlMaterial>& materials, const SceneFiles& files,
                            std::vector<std::string>& notices) {
  for (MtlMaterial& material : materials) {
    std::erase_if(material.maps, [&](const MtlMap& map) {
      const std::string path = existing_path(map_path(material, map), files);
      const bool missing = !files.exists(path);
      if (missing) {
        notices.push_back(fmt::format("left out: {}: there is no file {}", place_of(material, map), path));
      }
      return missing;
    });
  }
}

/// The place that first names a texture.
std::string place_of(const TextureImage& texture, const std::vector<MtlMaterial>& materials) {
  for (const MtlMaterial& material : materials) {
    for (const MtlMap& map : material.maps) {
      if (map_path(material, map) == texture.file) {
        return place_of(material, map);
      }
    }
  }
  return texture.name;
}

/// Reads the images that maps name.
Status load_textures(const std::vector<MtlMaterial>& materials, const SceneFiles& files, LoadedScene& loaded) {
  std::map<std::string, Sha256> read;
  for (TextureImage& texture : loaded.scene.textures) {
    const auto [known, added] = read.try_emplace(texture.file);
    if (added) {
      LM_ASSIGN_OR_RETURN(
          known->second,
          add_image_file(files, existing_path(texture.file, files),
                         {.name = utf8_name(texture.file), .place = place_of(texture, materials)}, loaded));
    }
    texture.asset = known->second;
    texture.file = utf8_name(texture.file);
  }
  return ok_status();
}

}  // namespace

Result<LoadedScene> load_objs(std::span<const fs::path> paths, KaMeaning ka, const SceneFiles& files) {
  LoadedScene loaded;
  MaterialList materials;
  for (const fs::path& path : paths) {
    ObjWithMaterials file{path, {}, {}, {}};
    LM_ASSIGN_OR_RETURN(file.obj, read_obj_file(files, path));
    LM_RETURN_IF_ERROR(load_libraries(file, files, loaded.notices));
    append_notices(file.obj.notices, loaded.notices);
    for (const ObjPart& part : file.obj.parts) {
      LM_ASSIGN_OR_RETURN(const std::uint32_t material, part_material(file, part, materials, loaded.notices));
      const std::array<const ObjPart*, 1> parts{&part};
      LM_ASSIGN_OR_RETURN(const Sha256 asset, add_mesh(make_mesh(file.obj, parts), loaded));
      const std::string stem = utf8_name(path.stem().string());
      loaded.scene.objects.push_back({part.material.empty() ? stem : stem + "/" + part.material, material,
                                      MeshShape{utf8_name(path.filename().string()), asset}});
    }
    loaded.scene.name += (loaded.scene.name.empty() ? "" : "+") + utf8_name(path.stem().string());
  }
  std::vector<MtlMaterial> all = materials.take();
  leave_out_missing_maps(all, files, loaded.notices);
  map_materials(all, ka, loaded.scene, loaded.notices);
  LM_RETURN_IF_ERROR(load_textures(all, files, loaded));
  loaded.scene.camera = course_cornell_camera();
  return loaded;
}

}  // namespace lightmill
