#include "common/image/png.h"

#include <spng.h>

#include <cstdlib>

#include "common/base/check.h"
#include "common/image/color.h"

namespace lightmill {
namespace {

constexpr std::uint32_t kMaxPngSide = 65536;  // pixels
constexpr std::size_t kMaxDecodedBytes = std::size_t{1} << 31;

struct ContextDeleter {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};
using Context = std::unique_ptr<spng_ctx, ContextDeleter>;

Status png_error(std::string_view what, int code) {
  return invalid_argument("{}: {}", what, spng_strerror(code));
}

}  // namespace

Result<std::string> encode_png(int width, int height, std::span<const std::uint8_t> rgb) {
  LM_CHECK(width > 0 && height > 0 && rgb.size() == std::size_t{3} * width * height);
  const Context context(spng_ctx_new(SPNG_CTX_ENCODER));
  LM_CHECK(context != nullptr, "out of memory");
  spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = 8;
  header.color_type = SPNG_COLOR_TYPE_TRUECOLOR;
  if (const int code = spng_set_ihdr(context.get(), &header); code != 0) {
    return png_error("cannot encode PNG", code);
  }
  spng_set_srgb(context.get(), 0);  // perceptual intent
  if (const int code = spng_encode_image(context.get(), rgb.data(), rgb.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
      code != 0) {
    return png_error("cannot encode PNG", code);
  }
  std::size_t size = 0;
  int code = 0;
  const std::unique_ptr<void, decltype(&std::free)> bytes(spng_get_png_buffer(context.get(), &size, &code), &std::free);
  if (bytes == nullptr) {
    return png_error("cannot encode PNG", code);
  }
  return std::string(static_cast<const char*>(bytes.get()), size);
}

Result<RgbImage> decode_png(ByteView bytes) {
  constexpr std::string_view kWhat = "not a readable PNG file";
  const Context context(spng_ctx_new(0));
  LM_CHECK(context != nullptr, "out of memory");
  spng_set_image_limits(context.get(), kMaxPngSide, kMaxPngSide);
  if (const int code = spng_set_png_buffer(context.get(), bytes.data(), bytes.size()); code != 0) {
    return png_error(kWhat, code);
  }
  spng_ihdr header{};
  if (const int code = spng_get_ihdr(context.get(), &header); code != 0) {
    return png_error(kWhat, code);
  }
  std::size_t size = 0;
  if (const int code = spng_decoded_image_size(context.get(), SPNG_FMT_RGBA16, &size); code != 0) {
    return png_error(kWhat, code);
  }
  if (size > kMaxDecodedBytes) {
    return invalid_argument("{}: {}x{} pixels are more than the limit of {} bytes", kWhat, header.width, header.height,
                            kMaxDecodedBytes);
  }
  std::vector<std::uint16_t> rgba(size / sizeof(std::uint16_t));
  if (const int code = spng_decode_image(context.get(), rgba.data(), size, SPNG_FMT_RGBA16, 0); code != 0) {
    return png_error(kWhat, code);
  }
  RgbImage image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
  const std::size_t pixels = image.pixels();
  image.values.resize(3 * pixels);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      image.values[channel * pixels + pixel] = srgb_decode(static_cast<float>(rgba[4 * pixel + channel]) / 65535.0f);
    }
  }
  return image;
}

}  // namespace lightmill
