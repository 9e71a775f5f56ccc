#include <map>
#include <set>

#include "common/scene/validate/validate.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/file_finder.h"
#include "common/scene_io/loaders.h"
#include "common/scene_io/missing_parts.h"
#include "common/scene_io/obj.h"
#include "common/scene_io/statement_reader.h"
#include "common/scene_io/tiles.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{64} << 20;

/// An OBJ file and the materials that it names.
struct ObjWithMaterials {
  fs::path path;
  ObjFile obj;
  std::vector<MtlMaterial> materials;
  std::map<std::string, std::size_t> by_name;  ///< index in `materials`
  bool libraries_are_missing = false;          ///< some of them
};

/// The file that a name means. A difference from the name is a fault. `place` ends with a colon and a blank.
std::optional<std::string> find_file(FileFinder& finder, const fs::path& folder, const std::string& written,
                                     const std::string& place, Faults& faults) {
  std::optional<std::string> found = finder.find(folder, written);
  if (found && *found != written) {
    faults.add("file " + written, fmt::format("{}there is no file {}", place, utf8_text(written)),
               "instead, " + utf8_text(*found) + " is read");
  }
  return found;
}

/// The files of a mtllib: one, or, if that does not exist, several with blanks between them.
std::vector<fs::path> library_files(ObjWithMaterials& file, const ObjLibrary& library, FileFinder& finder,
                                    Faults& faults) {
  const fs::path folder = file.path.parent_path();
  const std::string place = fmt::format("{}:{}: mtllib: ", file.path.string(), library.line);
  if (finder.find(folder, library.file) == library.file) {
    return {folder / library.file};
  }
  std::vector<fs::path> out;
  std::vector<std::string> missing;
  std::string_view rest = library.file;
  for (std::string word(take_word(rest)); !word.empty(); word = take_word(rest)) {
    if (const std::optional<std::string> found = find_file(finder, folder, word, place, faults)) {
      out.push_back(folder / *found);
    } else {
      missing.push_back(word);
    }
  }
  if (out.empty()) {
    if (const std::optional<std::string> whole = find_file(finder, folder, library.file, place, faults)) {
      return {folder / *whole};
    }
    missing = {library.file};
  }
  for (const std::string& name : missing) {
    file.libraries_are_missing = true;
    faults.add("file " + name, fmt::format("{}there is no file {}", place, utf8_text(name)),
               "its materials are rendered as grey diffuse");
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

/// Loads the libraries of a file. The first of several materials with one name is used.
Status load_libraries(ObjWithMaterials& file, const SceneFiles& files, FileFinder& finder, LoadedScene& loaded) {
  std::set<fs::path> read;
  for (const ObjLibrary& library : file.obj.libraries) {
    for (const fs::path& path : library_files(file, library, finder, loaded.faults)) {
      if (!read.insert(path).second) {
        continue;
      }
      LM_ASSIGN_OR_RETURN(
          const std::string text,
          with_context(files.read(path, kMaxMtlBytes), fmt::format("{}:{}: mtllib", file.path.string(), library.line)));
      for (const MtlMaterial& material : read_mtl(text, path.string(), loaded.faults)) {
        const auto [known, added] = file.by_name.try_emplace(material.name, file.materials.size());
        if (!added) {
          if (const MtlMaterial& first = file.materials[known->second]; !same_definition(first, material)) {
            append_notices({fmt::format("left out: {}:{}: material \"{}\", which {}:{} defines differently",
                                        material.file, material.line, material.name, first.file, first.line)},
                           loaded.notices);
          }
          continue;
        }
        file.materials.push_back(material);
      }
    }
  }
  return ok_status();
}

/// The materials of all files as one list. Equal materials are shared. Different materials of one name get their file's
/// name as well.
class MaterialList {
 public:
  /// Index of a file's material in the list.
  std::uint32_t add(MtlMaterial material) {
    std::string base;
    for (int round = 1;; ++round) {
      const auto [found, added] = index_.try_emplace(material.name, all_.size());
      if (added) {
        all_.push_back(material);
      }
      if (added || (round < kMaxCompared && same_definition(all_[found->second], material))) {
        return static_cast<std::uint32_t>(found->second);
      }
      const std::string file = utf8_text(fs::path(material.file).filename().string());
      if (round < kMaxCompared) {
        material.name = round == 1 ? fmt::format("{} ({})", material.name, file) : fmt::format("{}'", material.name);
        continue;
      }
      base = round == kMaxCompared ? material.name : base;
      material.name = fmt::format("{} {}", base, ++numbers_[base]);
    }
  }
  std::vector<MtlMaterial> take() { return std::move(all_); }

 private:
  static constexpr int kMaxCompared = 10;  ///< materials of one name and file name; others are not shared

  std::vector<MtlMaterial> all_;
  std::map<std::string, std::size_t> index_;
  std::map<std::string, std::size_t> numbers_;  ///< the last one of each name
};

/// The material of a part. It is added to the list.
std::uint32_t part_material(const ObjWithMaterials& file, const ObjPart& part, MaterialList& list,
                            LoadedScene& loaded) {
  if (const auto found = file.by_name.find(part.material); part.line != 0 && found != file.by_name.end()) {
    return list.add(file.materials[found->second]);
  }
  MtlMaterial grey;
  grey.name = part.material.empty() ? "default" : part.material;
  grey.file = file.path.string();
  if (!file.obj.colors.empty()) {
    grey.kd = RgbColor{1, 1, 1};  // the vertices have the colours
  }
  if (part.line == 0) {
    loaded.notices.push_back(fmt::format("{}: faces before the first usemtl are rendered as {} diffuse",
                                         file.path.string(), file.obj.colors.empty() ? "grey" : "white"));
  } else if (!part.material.empty() && !file.libraries_are_missing) {
    constexpr std::string_view kKind = "unknown material";
    std::string what;
    if (loaded.faults.needs_text(kKind)) {
      std::vector<Material> known;
      for (const MtlMaterial& material : file.materials) {
        known.emplace_back().name = material.name;
      }
      what = fmt::format("{}:{}: {}", file.path.string(), part.line, describe_unknown_material(part.material, known));
    }
    loaded.faults.add(kKind, what, "its faces are rendered as grey diffuse");
  }
  return list.add(grey);
}

std::string place_of(const MtlMaterial& material, const MtlMap& map) {
  return fmt::format("{}:{}: {} of material \"{}\"", material.file, map.line, map.keyword, material.name);
}

/// Finds the tiles of a map, and returns their name with the token.
std::optional<std::string> find_tiles_of(FileFinder& finder, const fs::path& folder, const std::string& written) {
  constexpr int kUsual = 100;  // numbers
  for (int number = kFirstTile; number < kFirstTile + kUsual; ++number) {
    if (std::optional<std::string> found = finder.find(folder, with_tile_number(written, number))) {
      constexpr std::size_t kDigits = 4;
      const std::size_t after = written.size() - written.rfind(kTileToken) - kTileToken.size();
      return found->replace(found->size() - after - kDigits, kDigits, kTileToken);
    }
  }
  return std::nullopt;
}

/// Gives each map the name of the file that it means. Leaves out maps without one: downloaded models often come without
/// their images. A map of emission takes the emission with it, because most of such maps are black.
void find_maps(std::vector<MtlMaterial>& materials, FileFinder& finder, Faults& faults) {
  for (MtlMaterial& material : materials) {
    const fs::path folder = fs::path(material.file).parent_path();
    std::erase_if(material.maps, [&](MtlMap& map) {
      const std::string place = place_of(material, map) + ": ";
      const std::optional<std::string> found = names_tiles(map.file)
                                                   ? find_tiles_of(finder, folder, map.file)
                                                   : find_file(finder, folder, map.file, place, faults);
      if (found) {
        map.file = *found;
        return false;
      }
      if (map.keyword == "map_Ke") {
        material.ke = RgbColor{};
      }
      faults.add("file " + map.file, fmt::format("{}there is no file {}", place, utf8_text(map.file)),
                 "the map is left out");
      return true;
    });
  }
}

/// The place that first names each file of a map.
std::map<std::string, std::string> places_of_maps(const std::vector<MtlMaterial>& materials) {
  std::map<std::string, std::string> places;
  for (const MtlMaterial& material : materials) {
    for (const MtlMap& map : material.maps) {
      places.try_emplace(map_path(material, map), place_of(material, map));
    }
  }
  return places;
}

/// Reads the images that maps name.
Status load_textures(const std::vector<MtlMaterial>& materials, const SceneFiles& files, LoadedScene& loaded) {
  const std::map<std::string, std::string> places = places_of_maps(materials);
  std::map<std::string, Sha256> read;
  const std::size_t textures = loaded.scene.textures.size();  // tiles add more
  for (std::size_t i = 0; i < textures; ++i) {
    TextureImage& texture = loaded.scene.textures[i];
    const std::string path = std::exchange(texture.file, utf8_text(texture.file));
    const ImageAsset image{.name = texture.file, .place = places.at(path)};
    if (names_tiles(path)) {
      LM_RETURN_IF_ERROR(add_tiles(files, path, static_cast<std::uint32_t>(i), image, loaded));
      continue;
    }
    const auto [known, added] = read.try_emplace(path);
    if (added) {
      LM_ASSIGN_OR_RETURN(known->second, add_image_file(files, path, image, loaded));
    }
    texture.asset = known->second;
  }
  return ok_status();
}

}  // namespace

Result<LoadedScene> load_objs(std::span<const fs::path> paths, KaMeaning ka, bool add_sky_if_unlit,
                              const SceneFiles& files) {
  LoadedScene loaded;
  MaterialList materials;
  FileFinder finder(files);
  for (const fs::path& path : paths) {
    ObjWithMaterials file{path, {}, {}, {}, false};
    LM_ASSIGN_OR_RETURN(file.obj, read_obj_file(files, path, loaded.faults));
    LM_RETURN_IF_ERROR(load_libraries(file, files, finder, loaded));
    append_notices(file.obj.notices, loaded.notices);
    for (const ObjPart& part : file.obj.parts) {
      const std::uint32_t material = part_material(file, part, materials, loaded);
      const std::array<const ObjPart*, 1> parts{&part};
      LM_ASSIGN_OR_RETURN(const Sha256 asset, add_mesh(make_mesh(file.obj, parts), loaded));
      const std::string stem = utf8_text(path.stem().string());
      LM_RETURN_IF_ERROR(with_context(add_object({part.material.empty() ? stem : stem + "/" + part.material, material,
                                                  MeshShape{utf8_text(path.filename().string()), asset}},
                                                 loaded),
                                      path.string()));
    }
    loaded.scene.name += (loaded.scene.name.empty() ? "" : "+") + utf8_text(path.stem().string());
  }
  std::vector<MtlMaterial> all = materials.take();
  find_maps(all, finder, loaded.faults);
  map_materials(all, ka, loaded.scene, loaded.notices);
  LM_RETURN_IF_ERROR(load_textures(all, files, loaded));
  add_missing_camera(loaded);
  if (add_sky_if_unlit) {
    add_missing_light(loaded);
  }
  return loaded;
}

}  // namespace lightmill
