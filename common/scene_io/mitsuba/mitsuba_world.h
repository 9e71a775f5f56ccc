// Converter of a Mitsuba scene's objects.
#pragma once

#include <set>

#include "common/scene_io/mitsuba/mitsuba_materials.h"
#include "common/scene_io/mitsuba/mitsuba_shapes.h"
#include "common/scene_io/mitsuba/mitsuba_xml.h"

namespace lightmill {

class MitsubaWorld {
 public:
  explicit MitsubaWorld(FileSource& files)
      : files_(files),
        notices_(loaded_.notices),
        textures_(files_, loaded_),
        materials_(textures_, notices_, loaded_.faults),
        shapes_(files_, loaded_, notices_) {}

  Result<LoadedScene> convert(const MitsubaObject& scene);

 private:
  /// A shape with its material.
  struct Piece {
    const MitsubaObject* object = nullptr;
    MitsubaShape shape;
    std::uint32_t material = 0;
  };

  Status set_views(const MitsubaObject& scene);
  Status say_integrator(const MitsubaObject& scene);
  void say_options(const MitsubaObject& integrator);
  Status add_lights(const std::vector<const MitsubaObject*>& emitters);
  Status add_shape(const MitsubaObject& from);
  Status add_instance(const MitsubaObject& from);
  /// The shapes of a group, each read once.
  Result<const std::vector<Piece>*> group(const MitsubaObject& from);
  /// Nothing if the shape cannot be seen.
  Result<std::optional<Piece>> piece_of(const MitsubaObject& from, bool in_group);
  Result<Material> material_of(const MitsubaObject& from, bool in_group, bool& visible, bool& one_sided);
  Status count_piece(const MitsubaObject& at);
  Result<std::uint32_t> material_index(Material material, const MitsubaObject& from);
  Status place(const Piece& piece, const Transform& to_scene, const MitsubaObject& at);

  FileSource& files_;
  LoadedScene loaded_;
  Notices notices_;
  MitsubaTextures textures_;
  MitsubaMaterials materials_;
  MitsubaShapes shapes_;
  Transform world_to_scene_ = kIdentityTransform;
  std::map<const MitsubaObject*, std::vector<Piece>> groups_;
  std::map<const MitsubaObject*, TexturedColor> emissions_;  ///< of emitters on shapes
  std::size_t placed_ = 0;                                   ///< pieces of groups, shapes and instances
  std::map<std::string, std::uint32_t> material_indices_;    ///< by all of a material
  std::set<std::string> names_;                              ///< of materials
  std::map<std::string, int> copies_;                        ///< materials of one name in the file
};

}  // namespace lightmill
