#include "common/wire/scene_parts.h"

#include <tuple>

#include "lightmill/v1/scene.pb.h"

namespace lightmill {

namespace {

v1::Texture::Wrap to_wire_wrap(TextureImage::Wrap wrap) {
  return static_cast<v1::Texture::Wrap>(static_cast<int>(wrap) + 1);
}

TextureImage::Wrap wrap_from_wire(v1::Texture::Wrap wrap, TextureImage::Wrap otherwise) {
  return wrap == v1::Texture::WRAP_UNSPECIFIED ? otherwise
                                               : static_cast<TextureImage::Wrap>(static_cast<int>(wrap) - 1);
}

}  // namespace

void to_wire_texture(const TextureImage& texture, const std::vector<TextureImage>& textures, v1::Texture* out) {
  out->set_name(texture.name);
  out->set_file(texture.file);
  out->set_asset(texture.asset.hex());
  out->set_filter(texture.filter == TextureImage::Filter::nearest ? v1::Texture::NEAREST : v1::Texture::BILINEAR);
  out->set_wrap(to_wire_wrap(texture.wrap[0]));
  if (texture.wrap[1] != texture.wrap[0]) {
    out->set_wrap_v(to_wire_wrap(texture.wrap[1]));
  }
  switch (texture.color_space) {
    case TextureImage::ColorSpace::automatic:
      break;
    case TextureImage::ColorSpace::srgb:
      out->set_color_space(v1::Texture::SRGB);
      break;
    case TextureImage::ColorSpace::linear:
      out->set_color_space(v1::Texture::LINEAR);
      break;
  }
  out->mutable_scale()->set_u(texture.scale[0]);
  out->mutable_scale()->set_v(texture.scale[1]);
  out->set_rotation_degrees(texture.rotation_degrees);
  out->mutable_offset()->set_u(texture.offset[0]);
  out->mutable_offset()->set_v(texture.offset[1]);
  out->set_tile(texture.tile);
  if (texture.tile_of != kNoTexture) {
    out->set_tile_of(textures[texture.tile_of].name);
  }
}

Result<TextureImage> texture_from_wire(const std::string& path, const v1::Texture& texture,
                                       const TextureNames& earlier) {
  TextureImage out;
  out.name = texture.name();
  out.file = texture.file();
  if (out.file.empty()) {
    return invalid_argument("{}.file: must be given", path);
  }
  for (const auto& [field, value, largest] :
       {std::tuple{"filter", static_cast<int>(texture.filter()), static_cast<int>(v1::Texture::Filter_MAX)},
        {"wrap", static_cast<int>(texture.wrap()), static_cast<int>(v1::Texture::Wrap_MAX)},
        {"wrap_v", static_cast<int>(texture.wrap_v()), static_cast<int>(v1::Texture::Wrap_MAX)},
        {"color_space", static_cast<int>(texture.color_space()), static_cast<int>(v1::Texture::ColorSpace_MAX)}}) {
    if (value < 0 || value > largest) {
      return invalid_argument("{}.{}: unknown value {}", path, field, value);
    }
  }
  out.filter =
      texture.filter() == v1::Texture::NEAREST ? TextureImage::Filter::nearest : TextureImage::Filter::bilinear;
  out.wrap[0] = wrap_from_wire(texture.wrap(), TextureImage::Wrap::repeat);
  out.wrap[1] = wrap_from_wire(texture.wrap_v(), out.wrap[0]);
  if (texture.color_space() != v1::Texture::COLOR_SPACE_UNSPECIFIED) {
    out.color_space =
        texture.color_space() == v1::Texture::SRGB ? TextureImage::ColorSpace::srgb : TextureImage::ColorSpace::linear;
  }
  if (texture.has_scale()) {
    out.scale = {texture.scale().u(), texture.scale().v()};
  }
  out.rotation_degrees = texture.rotation_degrees();
  if (texture.has_offset()) {
    out.offset = {texture.offset().u(), texture.offset().v()};
  }
  out.tile = texture.tile();
  if (!texture.tile_of().empty()) {
    const auto found = earlier.find(texture.tile_of());
    if (found == earlier.end()) {
      return invalid_argument("{}.tile_of: no texture before this one is called \"{}\"", path, texture.tile_of());
    }
    out.tile_of = found->second;
  }
  return out;
}

namespace {

Result<std::uint32_t> find_texture(const std::string& path, const std::string& name, const TextureNames& textures) {
  const auto found = textures.find(name);
  if (found == textures.end()) {
    return invalid_argument("{}.texture: unknown texture \"{}\": {}", path, name,
                            textures.empty() ? "there are no textures" : "textures must define it");
  }
  return found->second;
}

}  // namespace

void to_wire_textured(const TexturedColor& color, const std::vector<TextureImage>& textures, v1::Color* out) {
  to_wire_color(color.rgb, out);
  if (color.texture != kNoTexture) {
    out->set_texture(textures[color.texture].name);
  }
}

Result<TexturedColor> textured_from_wire(const std::string& path, bool given, const v1::Color& color,
                                         const TextureNames& textures) {
  TexturedColor out;
  if (!given || color.texture().empty()) {
    LM_ASSIGN_OR_RETURN(out.rgb, color_from_wire(path, given, color));
    return out;
  }
  out.rgb = {1, 1, 1};
  if (color.has_rgb()) {
    out.rgb = {color.rgb().r(), color.rgb().g(), color.rgb().b()};
  }
  LM_ASSIGN_OR_RETURN(out.texture, find_texture(path, color.texture(), textures));
  return out;
}

namespace {

/// `Message`: ScalarMap or BumpMap.
template <class Message>
void to_wire_channel(const ScalarMap& map, const std::vector<TextureImage>& textures, Message* out) {
  out->set_texture(textures[map.texture].name);
  out->set_channel(static_cast<v1::ScalarMap::Channel>(static_cast<int>(map.channel) + 1));
}

template <class Message>
Result<ScalarMap> channel_from_wire(const std::string& path, const Message& map, const TextureNames& textures) {
  ScalarMap out;
  LM_ASSIGN_OR_RETURN(out.texture, find_texture(path, map.texture(), textures));
  if (map.channel() != v1::ScalarMap::CHANNEL_UNSPECIFIED) {
    if (!v1::ScalarMap::Channel_IsValid(map.channel())) {
      return invalid_argument("{}.channel: unknown value {}", path, static_cast<int>(map.channel()));
    }
    out.channel = static_cast<ScalarMap::Channel>(static_cast<int>(map.channel()) - 1);
  }
  return out;
}

}  // namespace

void to_wire_map(const ScalarMap& map, const std::vector<TextureImage>& textures, v1::ScalarMap* out) {
  to_wire_channel(map, textures, out);
}

Result<ScalarMap> map_from_wire(const std::string& path, const v1::ScalarMap& map, const TextureNames& textures) {
  return channel_from_wire(path, map, textures);
}

void to_wire_normal_map(const NormalMap& map, const std::vector<TextureImage>& textures, v1::NormalMap* out) {
  out->set_texture(textures[map.texture].name);
  out->set_scale(map.scale);
}

Result<NormalMap> normal_map_from_wire(const std::string& path, const v1::NormalMap& map,
                                       const TextureNames& textures) {
  NormalMap out;
  LM_ASSIGN_OR_RETURN(out.texture, find_texture(path, map.texture(), textures));
  out.scale = map.has_scale() ? map.scale() : out.scale;
  return out;
}

void to_wire_bump_map(const BumpMap& map, const std::vector<TextureImage>& textures, v1::BumpMap* out) {
  to_wire_channel(map.map, textures, out);
  out->set_height(map.height);
}

Result<BumpMap> bump_map_from_wire(const std::string& path, const v1::BumpMap& map, const TextureNames& textures) {
  BumpMap out;
  LM_ASSIGN_OR_RETURN(out.map, channel_from_wire(path, map, textures));
  out.height = map.has_height() ? map.height() : out.height;
  return out;
}

}  // namespace lightmill
