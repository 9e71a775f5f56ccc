#include "tests/support/read_image.h"

#include <algorithm>

#include "common/image/read/opened_image.h"
#include "common/image/texels.h"

namespace lightmill {
namespace {

Result<Texels> read(ByteView bytes, std::int64_t max_pixels) {
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<OpenedImage> image, OpenedImage::open(bytes));
  LM_RETURN_IF_ERROR(image->check_limit(max_pixels));
  const bool words = image->size().bytes_per_pixel == 4;
  std::vector<std::uint32_t> packed(words ? image->size().pixels() : 0);
  std::vector<float> floats(words ? 0 : 4 * image->size().pixels());
  auto* next = words ? reinterpret_cast<std::byte*>(packed.data()) : reinterpret_cast<std::byte*>(floats.data());
  LM_RETURN_IF_ERROR(image->read([&](ByteView rows) {
    next = std::ranges::copy(rows, next).out;
    return ok_status();
  }));
  Texels out{image->width(), image->height(), std::move(packed), std::move(floats), image->encoded()};
  LM_RETURN_IF_ERROR(check_finite(out));
  return out;
}

}  // namespace

Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels) {
  Result<Texels> texels = read(bytes, max_pixels);
  return texels.ok() ? std::move(texels) : Result<Texels>(with_context(texels.status(), name));
}

Result<ImageSize> read_size(ByteView bytes, const std::string& name) {
  const Result<std::unique_ptr<OpenedImage>> image = OpenedImage::open(bytes);
  return image.ok() ? Result<ImageSize>((*image)->size()) : with_context(image.status(), name);
}

}  // namespace lightmill
