#include "server/assembly/denoised_tiles.h"

#include "common/base/check.h"
#include "common/film/reconstruct.h"

namespace lightmill {
namespace {

/// Calls f(place in the tile, place in the picture) for each pixel of a tile.
template <class F>
void for_each_pixel(const PixelRect& crop, const PixelRect& tile, F&& f) {
  std::size_t from = 0;
  for (int y = 0; y < tile.height; ++y) {
    auto to = static_cast<std::size_t>(tile.y - crop.y + y) * static_cast<std::size_t>(crop.width) +
              static_cast<std::size_t>(tile.x - crop.x);
    for (int x = 0; x < tile.width; ++x) {
      f(from++, to++);
    }
  }
}

/// Planes of the whole picture: `[channel][pixel]`.
struct Planes {
  explicit Planes(const FilmToDenoise& film)
      : pixels(static_cast<std::size_t>(film.crop.pixel_count())),
        half_a(kBeautyChannels * pixels),
        half_b(kBeautyChannels * pixels),
        features(film.features.channels * pixels),
        samples_a(pixels),
        samples_b(pixels) {
    for (const TileSnapshot& tile : film.tiles) {
      place_halves(film.crop, tile);
      place_features(film, tile);
    }
  }

  void place_halves(const PixelRect& crop, const TileSnapshot& tile) {
    const auto in_tile = static_cast<std::size_t>(tile.rect.pixel_count());
    const std::vector<float> sums = sums_over(tile.forest, tile.layout, in_tile, kBeautyChannels);
    const std::uint64_t count_a = tile.samples_a, count_b = tile.samples - tile.samples_a;
    const auto mean = [](float sum, std::uint64_t count) {
      return count == 0 ? 0.0f : sum / static_cast<float>(count);
    };
    for_each_pixel(crop, tile.rect, [&](std::size_t from, std::size_t to) {
      samples_a[to] = static_cast<std::uint32_t>(count_a);
      samples_b[to] = static_cast<std::uint32_t>(count_b);
      for (std::size_t channel = 0; channel < kBeautyChannels; ++channel) {
        half_a[channel * pixels + to] = mean(sums[channel * in_tile + from], count_a);
        half_b[channel * pixels + to] = mean(sums[(kBeautyChannels + channel) * in_tile + from], count_b);
      }
    });
  }

  void place_features(const FilmToDenoise& film, const TileSnapshot& tile) {
    const FirstValues first = first_of(tile);
    if (first.samples == 0) {
      return;
    }
    const auto in_tile = static_cast<std::size_t>(tile.rect.pixel_count());
    for_each_pixel(film.crop, tile.rect, [&](std::size_t from, std::size_t to) {
      for (std::size_t channel = 0; channel < film.features.channels; ++channel) {
        features[channel * pixels + to] =
            first.values[(film.features.first + channel) * in_tile + from] / static_cast<float>(first.samples);
      }
    });
  }

  std::size_t pixels;
  std::vector<float> half_a, half_b, features;
  std::vector<std::uint32_t> samples_a, samples_b;
};

}  // namespace

std::vector<DenoisedTile> denoised_tiles(const FilmToDenoise& film) {
  LM_CHECK(film.features.kind == LayerKind::first_mean);
  std::vector<float> picture;
  {
    const Planes planes(film);
    picture = reconstruct({film.crop.width, film.crop.height, planes.half_a, planes.half_b, planes.samples_a,
                           planes.samples_b, planes.features});
  }
  const auto pixels = static_cast<std::size_t>(film.crop.pixel_count());
  std::vector<DenoisedTile> tiles;
  for (const TileSnapshot& tile : film.tiles) {
    std::vector<float> rgbe(4 * static_cast<std::size_t>(tile.rect.pixel_count()), -1.0f);
    for_each_pixel(film.crop, tile.rect, [&](std::size_t to, std::size_t from) {
      for (std::size_t channel = 0; channel < kBeautyChannels; ++channel) {
        rgbe[4 * to + channel] = picture[channel * pixels + from];
      }
    });
    tiles.push_back({tile.rect, tile.samples, half_bytes(rgbe)});
  }
  return tiles;
}

}  // namespace lightmill
