#include "common/film/film_hash.h"

#include <bit>

#include "common/base/check.h"

static_assert(std::endian::native == std::endian::little, "planes are hashed as little-endian bytes");

namespace lightmill {

FilmPlanes::FilmPlanes(const PixelRect& crop_in, std::uint32_t channels_in) : crop(crop_in), channels(channels_in) {
  const auto pixels = static_cast<std::size_t>(crop.pixel_count());
  mean_a.resize(channels * pixels);
  mean_b.resize(channels * pixels);
  counts.resize(pixels);
}

void FilmPlanes::set_tile(const PixelRect& rect, std::span<const float> sums, std::uint64_t samples_a,
                          std::uint64_t samples_b) {
  const auto tile_pixels = static_cast<std::size_t>(rect.pixel_count());
  LM_CHECK(rect.x >= crop.x && rect.y >= crop.y && rect.x + rect.width <= crop.x + crop.width &&
           rect.y + rect.height <= crop.y + crop.height);
  LM_CHECK(sums.size() == 2 * channels * tile_pixels, "{} values for {} pixels", sums.size(), tile_pixels);
  const auto film_pixels = static_cast<std::size_t>(crop.pixel_count());
  const auto width = static_cast<std::size_t>(rect.width);
  const std::size_t corner = static_cast<std::size_t>(rect.y - crop.y) * crop.width + (rect.x - crop.x);
  for (int half = 0; half < 2; ++half) {
    std::vector<float>& mean = half == 0 ? mean_a : mean_b;
    const auto count = static_cast<float>(half == 0 ? samples_a : samples_b);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      for (std::size_t row = 0; row < static_cast<std::size_t>(rect.height); ++row) {
        const float* from = sums.data() + (half * channels + channel) * tile_pixels + row * width;
        float* to = mean.data() + channel * film_pixels + corner + row * crop.width;
        for (std::size_t x = 0; x < width; ++x) {
          to[x] = count > 0 ? from[x] / count : 0.0f;
        }
      }
    }
  }
  for (std::size_t row = 0; row < static_cast<std::size_t>(rect.height); ++row) {
    std::fill_n(counts.begin() + static_cast<std::ptrdiff_t>(corner + row * crop.width), width,
                static_cast<std::uint32_t>(samples_a + samples_b));
  }
}

Hash128 film_hash(const FilmPlanesView& planes) {
  Xxh3Hasher hasher;
  hasher.append(std::as_bytes(planes.mean_a));
  hasher.append(std::as_bytes(planes.mean_b));
  hasher.append(std::as_bytes(planes.counts));
  for (const std::span<const float> layer : planes.layers) {
    hasher.append(std::as_bytes(layer));
  }
  for (const Hash128& meter : planes.meters) {
    const std::array words{meter.low, meter.high};
    hasher.append(std::as_bytes(std::span(words)));
  }
  return hasher.finish();
}

Hash128 meter_hash(std::span<const float> sums, std::uint64_t samples_a, std::uint64_t samples_b) {
  Xxh3Hasher hasher;
  const std::array counts{samples_a, samples_b};
  hasher.append(std::as_bytes(std::span(counts)));
  hasher.append(std::as_bytes(sums));
  return hasher.finish();
}

}  // namespace lightmill
