// Materials and textures of a glTF file.
#pragma once

#include <map>
#include <optional>
#include <set>

#include "common/scene_io/gltf/gltf_mesh.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// Extensions of textures whose images are decoded.
inline constexpr std::string_view kWebpTextures = "EXT_texture_webp", kDdsTextures = "MSFT_texture_dds";

/// Converts a file's materials, each once, on demand. Metallic-roughness with transmission, volume, ior, clearcoat,
/// specular, anisotropy, sheen, emissive strength and normal maps becomes a principled material. Unlit materials emit
/// their colour. Emission 1 is a radiance of 1 W/(m² sr), as programs that write glTF mean it. Unsupported parts give
/// notices.
class GltfMaterials {
 public:
  /// Materials, textures and images go to `loaded`. `file_name` is for later errors of images.
  GltfMaterials(const GltfData& data, const std::string& file_name, LoadedScene& loaded, Notices& notices)
      : data_(data), file_name_(file_name), loaded_(loaded), notices_(notices) {}

  struct Used {
    std::uint32_t material = 0;                ///< index into the scene's materials
    std::optional<std::uint64_t> texture_set;  ///< of texture coordinates; nothing without a texture
    bool unlit = false;                        ///< KHR_materials_unlit
    bool tangents = false;                     ///< it has a normal map, or is anisotropic
    bool anisotropic = false;
  };
  /// The material `index`. The default material if it is missing.
  Used use(const JsonNode& index);

 private:
  Material map(const JsonNode& from);
  PrincipledMaterial principled(const JsonNode& from, Medium& interior);
  static Opacity opacity(const JsonNode& from, double value, std::uint32_t texture);
  void set_gloss(const JsonNode& extensions, PrincipledMaterial& out);
  void set_anisotropy(const JsonNode& from, PrincipledMaterial& out);
  void set_sheen(const JsonNode& from, PrincipledMaterial& out);
  void set_diffuse_transmission(const JsonNode& from, PrincipledMaterial kind, Material& out);
  void say_left_out(const JsonNode& from);
  TextureImage::Wrap wrap_of(const JsonNode& mode);
  /// The texture of a textureInfo, decoded in this colour space. kNoTexture if there is none.
  std::uint32_t texture(const JsonNode& info, TextureImage::ColorSpace color_space);
  /// A texture of data as a map, or none.
  ScalarMap scalar_map(const JsonNode& info, ScalarMap::Channel channel);
  std::optional<Sha256> image(const JsonNode& image, std::string& file);
  std::string unique_name(std::string name, std::string_view fallback);

  const GltfData& data_;
  const std::string& file_name_;
  LoadedScene& loaded_;
  Notices& notices_;
  std::map<std::string, Used> used_;               ///< by index, as written
  std::map<std::string, std::uint32_t> textures_;  ///< by all their properties
  std::map<std::string, std::pair<Sha256, std::string>> images_;
  std::set<std::string, std::less<>> names_;
  std::map<std::string, int> numbers_;        ///< the last number that was appended to a name
  std::optional<std::uint64_t> texture_set_;  ///< of the current material
};

}  // namespace lightmill
