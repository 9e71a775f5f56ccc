#include "server/assembly/tile_snapshot.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lightmill {
namespace {

constexpr float kMaxHalf = 65504;
/// Rec. 709, as sRGB has it.
constexpr std::array<float, kBeautyChannels> kLuminance{0.2126f, 0.7152f, 0.0722f};

/// Channel of the layer for R, G or B.
std::size_t channel_of(const LayerSlice& layer, std::size_t color) {
  return std::min<std::size_t>(color, layer.channels - 1);
}

std::string summed_pixels(const TileSnapshot& tile, const LayerSlice& layer) {
  const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
  const std::vector<float> sums = sums_over(tile.forest, tile.layout, pixels, layer.channels, layer.first);
  const auto all = static_cast<float>(tile.samples);
  const auto in_a = static_cast<float>(tile.samples_a);
  const float in_b = all - in_a;
  const bool both = in_a > 0 && in_b > 0;
  const float error_scale = both ? std::sqrt(in_a * in_b) / all : 0;
  const float scale = all > 0 ? 1 / all : 0;
  std::vector<float> rgbe(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    float difference = 0;
    for (std::size_t color = 0; color < kBeautyChannels; ++color) {
      const std::size_t channel = channel_of(layer, color);
      const float a = sums[channel * pixels + i];
      const float b = sums[(layer.channels + channel) * pixels + i];
      rgbe[4 * i + color] = (a + b) * scale;
      difference += both ? kLuminance[color] * (a / in_a - b / in_b) : 0;
    }
    rgbe[4 * i + 3] = both ? std::abs(difference) * error_scale : -1;
  }
  return half_bytes(rgbe);
}

/// For layers that come only from the first samples.
std::string first_pixels(const TileSnapshot& tile, const LayerSlice& layer) {
  const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
  const FirstValues first = first_of(tile);
  const bool nearest = layer.kind == LayerKind::first_nearest;
  const float scale = nearest || first.samples == 0 ? 1 : 1 / static_cast<float>(first.samples);
  const std::size_t begin = (nearest ? tile.layout.first_mean : 0) + layer.first;
  std::vector<float> rgbe(4 * pixels, -1.0f);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t color = 0; color < kBeautyChannels; ++color) {
      const std::size_t channel = begin + channel_of(layer, color);
      rgbe[4 * i + color] = first.samples == 0 ? 0 : first.values[channel * pixels + i] * scale;
    }
  }
  return half_bytes(rgbe);
}

}  // namespace

std::string half_bytes(const std::vector<float>& values) {
  std::string bytes(values.size() * 2, '\0');
  const __m128 most = _mm_set1_ps(kMaxHalf);
  for (std::size_t i = 0; i < values.size(); i += 4) {
    const __m128 clamped = _mm_max_ps(_mm_min_ps(_mm_loadu_ps(&values[i]), most), _mm_sub_ps(_mm_setzero_ps(), most));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(&bytes[2 * i]), _mm_cvtps_ph(clamped, _MM_FROUND_TO_NEAREST_INT));
  }
  return bytes;
}

TileSnapshot snapshot(const Film& film, TileId tile) {
  return {film.grid().tile_rect(tile), film.layout(), film.samples(tile), film.half_counts(tile).a, film.forest(tile)};
}

std::vector<float> sums_of(const TileSnapshot& tile) {
  return sums_over(tile.forest, tile.layout, static_cast<std::size_t>(tile.rect.pixel_count()), tile.layout.summed);
}

FirstValues first_of(const TileSnapshot& tile) {
  return first_over(tile.forest, tile.layout, static_cast<std::size_t>(tile.rect.pixel_count()));
}

std::vector<float> mean_rgb(const TileSnapshot& tile) {
  const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
  std::vector<float> sums = sums_over(tile.forest, tile.layout, pixels, kBeautyChannels);
  const float scale = tile.samples > 0 ? 1.0f / static_cast<float>(tile.samples) : 0.0f;
  const std::size_t half = kBeautyChannels * pixels;
  for (std::size_t i = 0; i < half; ++i) {
    sums[i] = (sums[i] + sums[half + i]) * scale;
  }
  sums.resize(half);
  return sums;
}

std::string view_pixels(const TileSnapshot& tile, const LayerSlice& layer) {
  switch (layer.kind) {
    case LayerKind::summed:
      return summed_pixels(tile, layer);
    case LayerKind::first_mean:
    case LayerKind::first_nearest:
      return first_pixels(tile, layer);
    case LayerKind::first_samples:
      break;
  }
  return "";
}

}  // namespace lightmill
