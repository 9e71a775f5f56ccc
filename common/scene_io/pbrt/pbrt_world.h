// Contents of a pbrt scene while its directives are read.
#pragma once

#include <memory>

#include "common/scene_io/pbrt/pbrt_lights.h"
#include "common/scene_io/pbrt/pbrt_materials.h"
#include "common/scene_io/pbrt/pbrt_shapes.h"
#include "common/scene_io/pbrt/pbrt_view.h"

namespace lightmill {

/// The state that directives set for later directives.
struct PbrtState {
  Transform to_scene = kIdentityTransform;  ///< before WorldBegin: to the camera
  bool reversed = false;
  std::size_t material = PbrtMaterials::kDefault;
  std::string named_material;  ///< instead of the number, if it is not empty
  std::shared_ptr<const PbrtAreaLight> light;
  std::string inside, outside;                          ///< media
  std::map<std::string, PbrtParameterList> attributes;  ///< of shapes, lights, …
};

/// Collects shapes, lights and instances. Materials are converted at the end, because files may name them before they
/// define them.
class PbrtWorld {
 public:
  explicit PbrtWorld(FileSource files)
      : files_(std::move(files)),
        notices_(loaded_.notices),
        spectra_(files_),
        textures_(files_, spectra_, loaded_, notices_),
        materials_(spectra_, textures_, notices_, loaded_.faults),
        media_(spectra_, notices_, loaded_.faults),
        shapes_(files_, notices_, loaded_.faults) {}

  FileSource& files() { return files_; }
  Notices& notices() { return notices_; }
  PbrtMaterials& materials() { return materials_; }
  PbrtMedia& media() { return media_; }
  PbrtTextures& textures() { return textures_; }

  Status set_view(const PbrtOptions& options, const SourcePlace& end);
  const Transform& world_to_scene() const { return view_.world_to_scene; }

  Status begin_object(const std::string& name, const SourcePlace& place);
  Status end_object(const SourcePlace& place);
  Status add_instance(const std::string& name, const PbrtState& state, const SourcePlace& place);
  Status add_shape(const std::string& type, const PbrtParameters& from, const PbrtState& state);
  Status add_light(const std::string& type, const PbrtParameters& from, const PbrtState& state);
  Result<std::shared_ptr<const PbrtAreaLight>> area_light(const std::string& type, const PbrtParameters& from);

  /// The place is for errors of the whole.
  Result<LoadedScene> finish(const SourcePlace& place_of_scene);

 private:
  /// The parts of one material of the scene.
  struct Use {
    std::size_t material = 0;
    std::string named_material;
    RgbColor emission;
    bool two_sided = false;
    PbrtValue opacity;
    std::string inside, outside;
    SourcePlace place;  ///< of the first shape
  };
  struct Piece {
    Use use;
    PbrtShape shape;
    std::optional<Sha256> asset;  ///< of the mesh, which is then empty
    std::shared_ptr<const PbrtAreaLight> light;
    bool reversed = false;
  };

  /// Puts a shape into the scene.
  Status place(Piece& piece, const Transform& to_scene, const SourcePlace& at);
  Status place_powered(const Piece& piece, const Transform& to_scene, const SourcePlace& at);
  Status add_object(const Use& use, std::variant<MeshShape, SphereShape, PlaneShape, TriangleShape> shape,
                    const Transform& transform, const SourcePlace& at);
  std::uint32_t use_index(const Use& use);
  Result<std::size_t> number_of(const Use& use) const;
  /// Whether the material has no texture. One that is not defined yet may have some.
  bool is_plain(const PbrtState& state, const SourcePlace& place) const;
  Result<Material> material_of(const Use& use);
  /// Where media are within each other, the inner one applies.
  Status set_priorities();
  Status merge_skies(const SourcePlace& place_of_scene);

  FileSource files_;
  LoadedScene loaded_;
  Notices notices_;
  PbrtSpectra spectra_;
  PbrtTextures textures_;
  PbrtMaterials materials_;
  PbrtMedia media_;
  PbrtShapes shapes_;
  PbrtView view_;
  std::vector<Use> uses_;
  std::map<std::string, std::uint32_t> use_indices_;
  std::size_t placed_ = 0;  ///< shapes and instances so far
  std::map<std::string, std::vector<Piece>> objects_;
  std::vector<Piece>* object_ = nullptr;  ///< the open one
};

}  // namespace lightmill
