#include "common/image/read/read_image.h"

#include <cmath>

#include "common/base/library_text.h"
#include "common/image/read/open_image.h"

namespace lightmill {
namespace {

/// What stands at `from`, `channels` values a pixel, as four: grey is spread, a missing alpha is `opaque`.
template <class T>
std::array<T, 4> four_channels(const T* from, int channels, T opaque) {
  switch (channels) {
    case 1:
      return {from[0], from[0], from[0], opaque};
    case 2:
      return {from[0], from[0], from[0], from[1]};
    case 3:
      return {from[0], from[1], from[2], opaque};
    default:
      return {from[0], from[1], from[2], from[3]};
  }
}

Status undecodable(const std::string& name, OIIO::ImageInput& input) {
  return invalid_argument("{}: the image is damaged, not all of its pixels can be read; save it again: {}", name,
                          library_text(input.geterror()));
}

Status fill_bytes(OIIO::ImageInput& input, int channels, const std::string& name, Texels& out) {
  const std::size_t pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  std::vector<std::uint8_t> values(pixels * static_cast<std::size_t>(channels));
  if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, values.data())) {
    return undecodable(name, input);
  }
  out.bytes.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto c = four_channels<std::uint8_t>(&values[i * static_cast<std::size_t>(channels)], channels, 255);
    out.bytes[i] = c[0] | c[1] << 8 | c[2] << 16 | static_cast<std::uint32_t>(c[3]) << 24;
  }
  return ok_status();
}

Status fill_floats(OIIO::ImageInput& input, int channels, const std::string& name, Texels& out) {
  const std::size_t pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  std::vector<float> values(pixels * static_cast<std::size_t>(channels));
  if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, values.data())) {
    return undecodable(name, input);
  }
  out.floats.reserve(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (const float value : four_channels<float>(&values[i * static_cast<std::size_t>(channels)], channels, 1.0f)) {
      if (!std::isfinite(value)) {
        const auto width = static_cast<std::size_t>(out.width);
        return invalid_argument("{}: pixel ({}, {}) is not finite", name, i % width, i / width);
      }
      out.floats.push_back(value);
    }
  }
  return ok_status();
}

}  // namespace

Result<Texels> read_image_within(ByteView bytes, const std::string& name, std::int64_t max_pixels) {
  OIIO::Filesystem::IOMemReader reader(const_cast<std::byte*>(bytes.data()), bytes.size());
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // else colours come multiplied by alpha
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<OIIO::ImageInput> input, open_image(bytes, name, reader, config));
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep) {
    return invalid_argument("{}: a flat image of at least one pixel and channel is expected", name);
  }
  if (std::int64_t{spec.width} * spec.height > max_pixels) {
    return resource_exhausted("{}: {}x{} pixels are more than --image-megapixels {:.4g} of the worker allows", name,
                              spec.width, spec.height, static_cast<double>(max_pixels) / (1 << 20));
  }
  Texels out;
  out.width = spec.width;
  out.height = spec.height;
  const bool is_float = spec.format.is_floating_point();
  out.encoded = !is_float;
  const int channels = std::min(spec.nchannels, 4);
  LM_RETURN_IF_ERROR(spec.format.basesize() == 1 ? fill_bytes(*input, channels, name, out)
                                                 : fill_floats(*input, channels, name, out));
  return out;
}

}  // namespace lightmill
