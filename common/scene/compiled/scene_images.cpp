#include "common/scene/compiled/scene_images.h"

#include <set>
#include <tuple>

#include "common/base/check.h"
#include "common/math/transcendental.h"

namespace lightmill {
namespace {

/// The textures that colours name.
std::set<std::uint32_t> textures_of_colors(const Scene& scene) {
  std::set<std::uint32_t> used;
  for (const Material& material : scene.materials) {
    for (const TexturedColor* color : colors_of(material)) {
      used.insert(color->texture);
    }
  }
  return used;
}

/// The textures of colours that surfaces scatter. Lookups of these average over footprints.
std::set<std::uint32_t> textures_of_scattered_colors(const Scene& scene) {
  std::set<std::uint32_t> used;
  for (const Material& material : scene.materials) {
    for_each_part(material, [&](const Material& part) {
      for (const TexturedColor* color : colors_of(part)) {
        if (color != &part.emission) {
          used.insert(color->texture);
        }
      }
    });
  }
  return used;
}

/// The images whose alpha cuts out shapes.
std::set<Sha256> cut_out_images(const Scene& scene) {
  std::set<Sha256> images;
  for (const Material& material : scene.materials) {
    const Opacity& opacity = material.opacity;
    if (opacity.mode != Opacity::Mode::opaque && opacity.map.texture != kNoTexture &&
        opacity.map.channel == ScalarMap::Channel::alpha) {
      images.insert(scene.textures[opacity.map.texture].asset);
    }
  }
  return images;
}

TextureWrap wrap_of(TextureImage::Wrap wrap) {
  switch (wrap) {
    case TextureImage::Wrap::repeat:
      return TextureWrap::repeat;
    case TextureImage::Wrap::clamp:
      return TextureWrap::clamp;
    case TextureImage::Wrap::mirror:
      return TextureWrap::mirror;
  }
  LM_CHECK(false, "wrap {}", static_cast<int>(wrap));
}

/// An image with the settings of the texture that it belongs to. Tiles do not repeat.
TextureImage with_settings(const TextureImage& image, const TextureImage& texture) {
  TextureImage out = texture;
  out.name = image.name;
  out.file = image.file;
  out.asset = image.asset;
  out.tile = image.tile;
  if (out.tile != 0) {
    out.wrap = {TextureImage::Wrap::clamp, TextureImage::Wrap::clamp};
  }
  return out;
}

TextureSettings settings_of(const TextureImage& image, const Texels& texels, bool color) {
  TextureSettings settings;
  settings.filter = image.filter == TextureImage::Filter::nearest ? TextureFilter::nearest : TextureFilter::bilinear;
  settings.decode = image.color_space == TextureImage::ColorSpace::automatic
                        ? texels.encoded && color
                        : image.color_space == TextureImage::ColorSpace::srgb;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    settings.wrap[axis] = wrap_of(image.wrap[axis]);
    settings.offset[axis] = static_cast<float>(image.offset[axis]);
  }
  const double angle = image.rotation_degrees * kPiDouble / 180;
  const double cosine = cos_fixed(angle), sine = sin_fixed(angle);
  const auto [u, v] = image.scale;
  settings.matrix = {{{static_cast<float>(cosine * u), static_cast<float>(-sine * v)},
                      {static_cast<float>(sine * u), static_cast<float>(cosine * v)}}};
  return settings;
}

/// Shares one image, and its pyramid, between all textures that name it.
class SharedImages {
 public:
  SharedImages(const CompiledScene::AssetSource& assets, const CompiledScene::ImageDecoder& images, ImageBudget& budget)
      : assets_(assets), images_(images), budget_(budget) {}

  /// `color`: whether a colour names the texture. A texture for numbers only has data.
  Result<Texture> texture(const TextureImage& image, bool color, const std::string& where) {
    std::shared_ptr<const Texels>& read = read_[image.asset];
    if (read == nullptr) {
      LM_CHECK(images_ != nullptr, "{}: a decoder of images is needed", where);
      LM_ASSIGN_OR_RETURN(const std::string bytes, with_context(assets_(image.asset), where));
      LM_ASSIGN_OR_RETURN(Texels texels, with_context(images_(as_byte_view(bytes), image.file), where));
      LM_RETURN_IF_ERROR(budget_.take(size_bytes(texels), where));
      read = std::make_shared<const Texels>(std::move(texels));
    }
    const TextureSettings settings = settings_of(image, *read, color);
    if (!settings.decode || read->floats.empty()) {
      return Texture(read, settings);
    }
    std::shared_ptr<const Texels>& linear = linear_[image.asset];
    if (linear == nullptr) {
      LM_RETURN_IF_ERROR(budget_.take(size_bytes(*read), where));
      linear = std::make_shared<const Texels>(decode_floats(*read));
    }
    return Texture(linear, settings);
  }

  /// An image of one texel has no smaller copies.
  Status add_pyramid(Texture& texture, TexturePyramid::Weight weight, const std::string& where) {
    if (texture.texels().width == 1 && texture.texels().height == 1) {
      return ok_status();
    }
    std::shared_ptr<const TexturePyramid>& pyramid = pyramids_[{&texture.texels(), texture.decodes(), weight}];
    if (pyramid == nullptr) {
      const Texels& texels = texture.texels();
      LM_RETURN_IF_ERROR(budget_.take(pyramid_bytes(texels.width, texels.height, bytes_per_pixel(texels)), where));
      pyramid = std::make_shared<const TexturePyramid>(texture.make_pyramid(weight));
    }
    texture.use_pyramid(pyramid);
    return ok_status();
  }

 private:
  const CompiledScene::AssetSource& assets_;
  const CompiledScene::ImageDecoder& images_;
  ImageBudget& budget_;
  std::map<Sha256, std::shared_ptr<const Texels>> read_, linear_;
  std::map<std::tuple<const Texels*, bool, TexturePyramid::Weight>, std::shared_ptr<const TexturePyramid>> pyramids_;
};

}  // namespace

Result<TextureSet> load_textures(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 const CompiledScene::ImageDecoder& images, ImageBudget& budget) {
  TextureSet textures;
  const std::set<std::uint32_t> colors = textures_of_colors(scene), scattered = textures_of_scattered_colors(scene);
  const std::set<Sha256> cut_out = cut_out_images(scene);
  SharedImages shared(assets, images, budget);
  for (std::uint32_t i = 0; i < scene.textures.size(); ++i) {
    const std::uint32_t whole = scene.textures[i].tile_of != kNoTexture ? scene.textures[i].tile_of : i;
    const TextureImage image = with_settings(scene.textures[i], scene.textures[whole]);
    const std::string where = fmt::format("textures[{}] \"{}\"", i, image.name);
    LM_ASSIGN_OR_RETURN(Texture texture, shared.texture(image, colors.contains(whole), where));
    if (scattered.contains(whole) && image.filter != TextureImage::Filter::nearest) {
      const bool by_alpha = cut_out.contains(scene.textures[whole].asset);
      const auto weight = by_alpha ? TexturePyramid::Weight::alpha : TexturePyramid::Weight::area;
      LM_RETURN_IF_ERROR(shared.add_pyramid(texture, weight, where));
    }
    textures.add(std::move(texture));
    if (image.tile != 0) {
      const auto square = static_cast<std::uint32_t>(image.tile - kFirstTile);
      textures.set_tile(whole, square, i);
    }
  }
  return textures;
}

}  // namespace lightmill
