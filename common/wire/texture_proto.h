// Conversion of textures, and of colours that name them, between messages and values. Errors begin with the path of the
// field.
#pragma once

#include <map>
#include <string>

#include "common/scene/document.h"

namespace lightmill::v1 {
class BumpMap;
class Color;
class NormalMap;
class ScalarMap;
class Texture;
}  // namespace lightmill::v1

namespace lightmill {

/// Indices of textures by name.
using TextureNames = std::map<std::string, std::uint32_t, std::less<>>;
TextureNames texture_names(const std::vector<TextureImage>& textures);

void to_wire_texture(const TextureImage& texture, v1::Texture* out);
/// Without the texture's asset.
Result<TextureImage> texture_from_wire(const std::string& path, const v1::Texture& texture);

void to_wire_textured(const TexturedColor& color, const std::vector<TextureImage>& textures, v1::Color* out);
/// `given`: whether the document has the field. It must.
Result<TexturedColor> textured_from_wire(const std::string& path, bool given, const v1::Color& color,
                                         const TextureNames& textures);

void to_wire_map(const ScalarMap& map, const std::vector<TextureImage>& textures, v1::ScalarMap* out);
void to_wire_normal_map(const NormalMap& map, const std::vector<TextureImage>& textures, v1::NormalMap* out);
Result<NormalMap> normal_map_from_wire(const std::string& path, const v1::NormalMap& map, const TextureNames& textures);
void to_wire_bump_map(const BumpMap& map, const std::vector<TextureImage>& textures, v1::BumpMap* out);
Result<BumpMap> bump_map_from_wire(const std::string& path, const v1::BumpMap& map, const TextureNames& textures);
Result<ScalarMap> map_from_wire(const std::string& path, const v1::ScalarMap& map, const TextureNames& textures);

}  // namespace lightmill
