// Colours, spectra and textures of a Mitsuba scene.
#pragma once

#include <map>

#include "common/scene_io/assets.h"
#include "common/scene_io/file_finder.h"
#include "common/scene_io/mitsuba/mitsuba_object.h"
#include "common/scene_io/spectrum.h"

namespace lightmill {

/// Converts parameters of the types float, rgb and spectrum, and nested textures. Colours are those of Mitsuba's RGB
/// variants. Texture coordinates of meshes must have v upwards, as in a scene document. Mitsuba counts v downwards.
class MitsubaTextures {
 public:
  MitsubaTextures(FileSource& files, LoadedScene& loaded) : files_(files), loaded_(loaded) {}

  /// Of a surface: each component in [0, 1].
  TexturedColor color(const MitsubaObject& from, std::string_view name, const RgbColor& fallback);
  /// Of a light, without a limit. The default is white.
  TexturedColor light(const MitsubaObject& from, std::string_view name);
  /// The same without a texture, which is an error.
  RgbColor plain_light(const MitsubaObject& from, std::string_view name);
  /// Each component at least 0, as of a medium. Textures are errors.
  RgbColor coefficient(const MitsubaObject& from, std::string_view name, double fallback, double high);
  /// A number in [low, high], times a texture whose luminance counts.
  TexturedColor number(const MitsubaObject& from, std::string_view name, double fallback, double low, double high);
  /// Of metals: n or k at three wavelengths. Textures are errors.
  RgbColor metal(const MitsubaObject& from, std::string_view name, double fallback);
  /// int_ior over ext_ior, which are numbers or names of media.
  double ior(const MitsubaObject& from, std::string_view fallback);

  /// The image of a nested texture whose values are data. kNoTexture if it is a constant.
  std::uint32_t data(const MitsubaObject& user, const MitsubaObject& texture);

 private:
  enum class Kind { surface, light };

  std::optional<RgbColor> plain(const MitsubaObject& from, const MitsubaParameter& parameter, Kind kind);
  std::optional<Spectrum> samples(const MitsubaObject& from, const MitsubaParameter& parameter);
  TexturedColor value(const MitsubaObject& from, std::string_view name, const RgbColor& fallback, Kind kind);
  /// A texture that `user` names, which gets its errors.
  TexturedColor texture(const MitsubaObject& user, const MitsubaObject& from, Kind kind);
  Result<TexturedColor> read(const MitsubaObject& from, Kind kind);
  TexturedColor bitmap(const MitsubaObject& from);
  TexturedColor checkerboard(const MitsubaObject& from);
  /// Sets scale and offset of the texture coordinates.
  void place(const MitsubaObject& from, TextureImage& out);
  double medium_ior(const MitsubaObject& from, std::string_view name, std::string_view fallback);
  TexturedColor add(const MitsubaObject& from, TextureImage image, float factor);

  FileSource& files_;
  LoadedScene& loaded_;
  std::map<std::pair<const MitsubaObject*, Kind>, Result<TexturedColor>> known_;
  int nesting_ = 0;
  std::map<std::string, std::pair<Sha256, std::string>> images_;  ///< that were read: asset and name
};

}  // namespace lightmill
