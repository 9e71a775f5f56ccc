// Materials and media of a Mitsuba scene.
#pragma once

#include <tuple>

#include "common/scene_io/mitsuba/mitsuba_textures.h"
#include "common/scene_io/notices.h"
#include "common/scene_io/rough_coat.h"

namespace lightmill {

struct MitsubaSurface {
  Material material;       ///< without emission and medium
  bool null = false;       ///< light passes as if there were no surface
  bool one_sided = false;  ///< black from behind in Mitsuba
};

/// Converts BSDFs and media, each once.
class MitsubaMaterials {
 public:
  MitsubaMaterials(MitsubaTextures& textures, Notices& notices, Faults& faults)
      : textures_(textures), notices_(notices), faults_(faults) {}

  /// An error names its place.
  Result<MitsubaSurface> convert(const MitsubaObject& bsdf);
  Result<Medium> medium(const MitsubaObject& from);

 private:
  Result<MitsubaSurface> read(const MitsubaObject& from);
  Result<MitsubaSurface> nested(const MitsubaObject& from);
  Result<MitsubaSurface> masked(const MitsubaObject& from);
  Result<MitsubaSurface> blended(const MitsubaObject& from);
  Result<MitsubaSurface> normal_mapped(const MitsubaObject& from);
  void set_kind(const MitsubaObject& from, MitsubaSurface& out);
  void thin_dielectric(const MitsubaObject& from, Material& out);
  void conductor(const MitsubaObject& from, Material& out);
  void plastic(const MitsubaObject& from, Material& out);
  void principled(const MitsubaObject& from, MitsubaSurface& out);
  /// The base colour of a principled material that is as bright as rough plastic.
  void set_base_below_rough_coat(const MitsubaObject& from, const TexturedColor& albedo, double alpha,
                                 PrincipledMaterial& out);
  /// alpha of GGX along u and v. 0 for smooth types.
  std::array<double, 2> alphas(const MitsubaObject& from);
  /// √alpha of GGX, for kinds that are always isotropic: the mean of both directions, with a notice.
  double roughness(const MitsubaObject& from);
  void set_anisotropy(double strength, const MitsubaSurface& surface, PrincipledMaterial& out);
  /// Fails if a factor that physical materials do not have is not 1.
  void require_one(const MitsubaObject& from, std::string_view name);

  MitsubaTextures& textures_;
  Notices& notices_;
  Faults& faults_;
  std::map<const MitsubaObject*, Result<MitsubaSurface>> known_;
  std::map<const MitsubaObject*, Medium> media_;
  std::map<std::tuple<double, double, bool>, RoughCoat> coats_;  ///< by index, alpha and distribution
  int nesting_ = 0;
};

}  // namespace lightmill
