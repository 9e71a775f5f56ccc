// Textures of a pbrt scene.
#pragma once

#include <map>

#include "common/scene_io/assets.h"
#include "common/scene_io/notices.h"
#include "common/scene_io/pbrt/pbrt_spectra.h"

namespace lightmill {

/// A value of a parameter: a colour, times an image if there is one. A number is a grey.
struct PbrtValue {
  RgbColor color{1, 1, 1};
  std::uint32_t texture = kNoTexture;  ///< index into Scene::textures

  bool varies() const { return texture != kNoTexture; }
};

/// Defines textures in the file's order. Textures that a scene document cannot express are errors where they are used.
class PbrtTextures {
 public:
  PbrtTextures(FileSource& files, PbrtSpectra& spectra, LoadedScene& loaded, Notices& notices)
      : files_(files), spectra_(spectra), loaded_(loaded), notices_(notices) {}

  /// A Texture directive. `kind` is "float" or "spectrum".
  Status define(const std::string& name, const std::string& kind, const std::string& type, const PbrtParameters& from);

  /// A colour or a spectrum texture. Its components are in [0, high].
  PbrtValue color(const PbrtParameters& from, std::string_view name, const RgbColor& fallback, double high = 1);
  /// A number or a float texture.
  PbrtValue number(const PbrtParameters& from, std::string_view name, double fallback);
  /// The image of a normal map. kNoTexture if there is none.
  std::uint32_t normal_map(const PbrtParameters& from);

 private:
  using Defined = std::map<std::string, Result<PbrtValue>>;

  Result<PbrtValue> value_of(const std::string& kind, const std::string& type, const PbrtParameters& from);
  Result<PbrtValue> image_map(const PbrtParameters& from);
  Result<PbrtValue> checkerboard(const std::string& kind, const PbrtParameters& from);
  Result<PbrtValue> scaled(const std::string& kind, const PbrtParameters& from);
  Result<PbrtValue> mixed(const std::string& kind, const PbrtParameters& from);
  PbrtValue either(const std::string& kind, const PbrtParameters& from, std::string_view name, double fallback);
  std::optional<PbrtValue> texture(const Defined& defined, const PbrtParameters& from, std::string_view name);
  /// Sets scale and offset of the texture coordinates.
  Status place(const PbrtParameters& from, TextureImage& out);
  /// The image file as an asset. Nothing if there is none, which is a fault.
  std::optional<Sha256> image(const PbrtParameters& from, std::string_view name, std::string& file);
  std::uint32_t add(TextureImage image);

  FileSource& files_;
  PbrtSpectra& spectra_;
  LoadedScene& loaded_;
  Notices& notices_;
  Defined floats_, spectra_by_name_;
  std::map<std::string, std::uint32_t> added_;                    ///< textures by all their properties
  std::map<std::string, std::pair<Sha256, std::string>> images_;  ///< that were read: asset and name
};

}  // namespace lightmill
