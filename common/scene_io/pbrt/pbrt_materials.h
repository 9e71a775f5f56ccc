// Materials and media of a pbrt scene.
#pragma once

#include "common/materials/metals.h"
#include "common/scene_io/pbrt/pbrt_textures.h"
#include "common/scene_io/rough_coat.h"

namespace lightmill {

/// Defines materials in the file's order, and converts them when all are known.
class PbrtMaterials {
 public:
  /// Number of the material of shapes before any directive: diffuse.
  static constexpr std::size_t kDefault = 0;

  PbrtMaterials(PbrtSpectra& spectra, PbrtTextures& textures, Notices& notices, Faults& faults);

  /// A Material directive. Returns its number.
  std::size_t define(std::string type, PbrtParameters from);
  Status define_named(const std::string& name, PbrtParameters from);
  /// The number of a named material, or an error.
  Result<std::size_t> named(const std::string& name, const SourcePlace& place) const;
  /// Whether a material certainly has no texture and no anisotropy.
  bool is_plain(std::size_t number) const;
  /// Whether the surface only bounds a medium.
  bool is_interface(std::size_t number) const { return definitions_[number].type == "interface"; }

  /// The material without emission, opacity and medium. An error names its place.
  Result<Material> convert(std::size_t number);

 private:
  struct Definition {
    std::string type, name;
    PbrtParameters from;
    std::optional<Material> converted;
  };

  Result<Material> mixed(const Definition& definition);
  void set_kind(const std::string& type, const PbrtParameters& from, Material& out);
  ConductorMaterial conductor(const PbrtParameters& from, const std::string& prefix);
  void subsurface(const PbrtParameters& from, Material& out);
  void coated_diffuse(const PbrtParameters& from, Material& out);
  void set_base_below_coat(const PbrtParameters& from, const TexturedColor& albedo, PrincipledMaterial& out);
  void coated_conductor(const PbrtParameters& from, Material& out);
  /// alpha of GGX along u and v. Textures are left out, with a notice.
  std::array<double, 2> alphas(const PbrtParameters& from, const std::string& prefix) const;
  /// √alpha of GGX, for kinds that are always isotropic: the mean of both directions, with a notice.
  double roughness(const PbrtParameters& from, const std::string& prefix);
  void set_relief(const PbrtParameters& from, Material& out);

  PbrtSpectra& spectra_;
  PbrtTextures& textures_;
  Notices& notices_;
  Faults& faults_;
  std::vector<Definition> definitions_;
  std::map<std::string, std::size_t> by_name_;
  std::map<std::tuple<double, double, double>, RoughCoat> coats_;  ///< by index, alpha and thickness
  int mixing_ = 0;                                                 ///< mixtures around the one that is converted
};

/// The media of MakeNamedMedium.
class PbrtMedia {
 public:
  PbrtMedia(PbrtSpectra& spectra, Notices& notices, Faults& faults)
      : spectra_(spectra), notices_(notices), faults_(faults) {}

  Status define(const std::string& name, const PbrtParameters& from);
  /// No name is the vacuum.
  Result<Medium> find(const std::string& name, const SourcePlace& place) const;

 private:
  PbrtSpectra& spectra_;
  Notices& notices_;
  Faults& faults_;
  std::map<std::string, Medium> media_;
};

}  // namespace lightmill
