#include "tests/support/read_image.h"

#include <algorithm>

#include "common/image/read/opened_image.h"
#include "common/materials/texel_values.h"

namespace lightmill {
namespace {

Result<Texels> read(ByteView bytes, std::int64_t max_pixels) {
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<OpenedImage> image, OpenedImage::open(bytes));
  LM_RETURN_IF_ERROR(image->check_limit(max_pixels));
  const ImageSize size = image->size();
  Texels out{image->width(), image->height(), {}, {}, image->encoded(), {}, image->half()};
  std::vector<std::uint32_t> packed(size.bytes_per_pixel == 4 ? size.pixels() : 0);
  std::vector<std::uint64_t> words(size.bytes_per_pixel == 8 ? size.pixels() : 0);
  std::vector<float> floats(size.bytes_per_pixel == 16 ? 4 * size.pixels() : 0);
  auto* next = reinterpret_cast<std::byte*>(packed.data());
  next = words.empty() ? next : reinterpret_cast<std::byte*>(words.data());
  next = floats.empty() ? next : reinterpret_cast<std::byte*>(floats.data());
  LM_RETURN_IF_ERROR(image->read([&](ByteView rows) {
    next = std::ranges::copy(rows, next).out;
    return ok_status();
  }));
  out.bytes = std::move(packed);
  out.words = std::move(words);
  out.floats = std::move(floats);
  LM_RETURN_IF_ERROR(check_finite(out));
  return out;
}

}  // namespace

Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels) {
  Result<Texels> texels = read(bytes, max_pixels);
  return texels.ok() ? std::move(texels) : Result<Texels>(with_context(texels.status(), name));
}

std::vector<float> values_of(const Texels& texels) {
  if (!texels.floats.empty()) {
    return {texels.floats.begin(), texels.floats.end()};
  }
  const std::span<const float> values = texel_values(texels, false);
  std::vector<float> out;
  for (std::size_t pixel = 0; pixel < texels.bytes.size() + texels.words.size(); ++pixel) {
    for (std::size_t channel = 0; channel < 4; ++channel) {
      out.push_back(values[component(texels, pixel, channel)]);
    }
  }
  return out;
}

Result<ImageSize> read_size(ByteView bytes, const std::string& name) {
  const Result<std::unique_ptr<OpenedImage>> image = OpenedImage::open(bytes);
  return image.ok() ? Result<ImageSize>((*image)->size()) : with_context(image.status(), name);
}

}  // namespace lightmill
