#include "common/scene/compiled/texture_sources.h"

#include "common/base/check.h"

namespace lightmill {
namespace {

TextureSettings settings_of(const TextureImage& image, const Texels& texels) {
  TextureSettings settings;
  settings.filter = image.filter == TextureImage::Filter::nearest ? TextureFilter::nearest : TextureFilter::bilinear;
  settings.wrap = image.wrap == TextureImage::Wrap::repeat ? TextureWrap::repeat : TextureWrap::clamp;
  settings.decode = image.color_space == TextureImage::ColorSpace::automatic
                        ? texels.encoded
                        : image.color_space == TextureImage::ColorSpace::srgb;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    settings.scale[axis] = static_cast<float>(image.scale[axis]);
    settings.offset[axis] = static_cast<float>(image.offset[axis]);
  }
  return settings;
}

}  // namespace

Result<TextureSet> load_textures(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 const CompiledScene::ImageDecoder& images) {
  TextureSet textures;
  std::map<Sha256, std::shared_ptr<const Texels>> loaded;
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    const TextureImage& image = scene.textures[i];
    const std::string where = fmt::format("textures[{}] \"{}\"", i, image.name);
    std::shared_ptr<const Texels>& texels = loaded[image.asset];
    if (texels == nullptr) {
      LM_CHECK(images != nullptr, "{}: a decoder of images is needed", where);
      Result<std::string> bytes = assets(image.asset);
      if (!bytes.ok()) {
        return with_context(bytes.status(), where);
      }
      Result<Texels> decoded = images(as_byte_view(*bytes), image.file);
      if (!decoded.ok()) {
        return with_context(decoded.status(), where);
      }
      texels = std::make_shared<const Texels>(std::move(*decoded));
    }
    textures.add(Texture(texels, settings_of(image, *texels)));
  }
  return textures;
}

}  // namespace lightmill
