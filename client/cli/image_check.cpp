#include "client/cli/image_check.h"

#include <set>

#include "common/scene_io/picture_notices.h"

namespace lightmill::cli {
namespace {

std::uint64_t negative_pixels(const Texels& texels) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i + 3 < texels.floats.size(); i += 4) {
    const float* rgb = &texels.floats[i];
    count += rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0 ? 1 : 0;
  }
  return count;
}

Status check_image(DecoderProcess& decoder, const ImageAsset& image, LoadedScene& loaded) {
  const ByteView bytes = as_byte_view(loaded.assets.at(image.asset));
  const Result<ImageSize> size = decoder.size(bytes, image.name);
  const Result<Texels> texels = size.ok() ? decoder.decode(bytes, image.name) : size.status();
  if (!texels.ok()) {
    return with_context(texels.status(), image.place);
  }
  LM_RETURN_IF_ERROR(check_image_header(image, *size, loaded.notices));
  if (const std::uint64_t negative = negative_pixels(*texels); negative > 0) {
    loaded.notices.push_back(fmt::format("{}: {}: {} of {} pixels have negative values, which count as 0", image.place,
                                         image.name, negative, std::int64_t{texels->width} * texels->height));
  }
  return ok_status();
}

}  // namespace

Status check_images(const DecoderOptions& decoder, LoadedScene& loaded, const Signals& signals) {
  DecoderProcess process(decoder);
  std::set<std::tuple<Sha256, std::string, bool>> checked;
  for (const ImageAsset& image : loaded.images) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    if (checked.emplace(image.asset, image.name, image.environment).second) {
      LM_RETURN_IF_ERROR(check_image(process, image, loaded));
    }
  }
  return ok_status();
}

}  // namespace lightmill::cli
