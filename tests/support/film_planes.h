// Sums and planes of a whole film, as the film hash defines them.
#pragma once

#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/film/film.h"
#include "common/film/film_hash.h"

namespace lightmill::test {

/// The sums of all summed channels of a tile, laid out as Node::values.
inline std::vector<float> sums_of(const Film& film, TileId tile) {
  return sums_over(film.forest(tile), film.layout(),
                   static_cast<std::size_t>(film.grid().tile_rect(tile).pixel_count()), film.layout().summed);
}

/// The planes of a film of beauty alone.
struct FilmPlanes {
  FilmPlanes() = default;
  explicit FilmPlanes(const PixelRect& crop_in)
      : crop(crop_in),
        mean_a(kBeautyChannels * static_cast<std::size_t>(crop.pixel_count())),
        mean_b(mean_a.size()),
        counts(mean_a.size() / kBeautyChannels) {}

  /// `sums`: as Node::values for `rect`, which lies within the crop, over `a` + `b` samples per pixel.
  void set_tile(const PixelRect& rect, const std::vector<float>& sums, std::uint64_t a, std::uint64_t b) {
    LM_CHECK(sums.size() == 2 * kBeautyChannels * static_cast<std::size_t>(rect.pixel_count()));
    auto sum = sums.begin();
    for (const auto& [mean, samples] : {std::pair{&mean_a, a}, std::pair{&mean_b, b}}) {
      for (std::size_t channel = 0; channel < kBeautyChannels; ++channel) {
        for (int y = rect.y; y < rect.y + rect.height; ++y) {
          for (int x = rect.x; x < rect.x + rect.width; ++x, ++sum) {
            mean->at(channel * counts.size() + index_of(x, y)) = samples > 0 ? *sum / static_cast<float>(samples) : 0;
            counts.at(index_of(x, y)) = static_cast<std::uint32_t>(a + b);
          }
        }
      }
    }
  }
  operator FilmPlanesView() const { return {mean_a, mean_b, counts, {}, {}}; }  // NOLINT(google-explicit-constructor)

  PixelRect crop;
  std::vector<float> mean_a, mean_b;
  std::vector<std::uint32_t> counts;

 private:
  std::size_t index_of(int x, int y) const {
    return static_cast<std::size_t>(y - crop.y) * static_cast<std::size_t>(crop.width) +
           static_cast<std::size_t>(x - crop.x);
  }
};

}  // namespace lightmill::test
