#include "server/assembly/denoised_tiles.h"

#include <gtest/gtest.h>
#include <immintrin.h>

#include <random>

#include "common/film/reconstruct.h"
#include "common/image/film_picture.h"
#include "tests/support/film_planes.h"

namespace lightmill {
namespace {

constexpr std::array<std::string_view, 3> kLayers{"normal", kFeaturesLayer, "depth"};

/// A film of noise. Its first tile has no samples, and its second one has only one.
Film noisy_film(const PixelRect& crop, const std::vector<LayerSpec>& layers) {
  Film film{TileGrid(crop), NodeLayout(layers)};
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0.1f, 4);
  for (std::uint32_t tile = 1; tile < film.grid().picture_tiles(); ++tile) {
    auto node = std::make_shared<Node>();
    node->range = {tile == 1 ? 0u : 5u, 0};
    node->values.resize(film.expected_values(TileId{tile}, node->range));
    std::ranges::generate(node->values, [&] { return value(random); });
    film.merge(TileId{tile}, node);
  }
  return film;
}

FilmToDenoise snapshot_of(const Film& film, const LayerSlice& features) {
  FilmToDenoise out{film.grid().crop(), features, {}};
  for (std::uint32_t tile = 0; tile < film.grid().picture_tiles(); ++tile) {
    out.tiles.push_back(snapshot(film, TileId{tile}));
  }
  return out;
}

/// The picture that `fetch --denoise` makes of the film.
std::vector<float> fetched(const Film& film) {
  const PixelRect crop = film.grid().crop();
  const ImageWindow window{crop.x, crop.y, crop.width, crop.height};
  FilmPicture picture(window, window);
  for (const std::string_view layer : kLayers) {
    picture.layers.push_back(make_picture_layer(std::string(layer), picture.pixels()));
  }
  PictureIds no_ids;
  for (std::uint32_t tile = 0; tile < film.grid().picture_tiles(); ++tile) {
    const TileSnapshot shot = snapshot(film, TileId{tile});
    const ImageWindow rect{shot.rect.x, shot.rect.y, shot.rect.width, shot.rect.height};
    place_sums(picture, rect, shot.samples_a, shot.samples - shot.samples_a, sums_of(shot));
    const FirstValues first = first_of(shot);
    EXPECT_TRUE(place_first_samples(picture.layers, window, rect, first.samples, first.values, no_ids));
  }
  return reconstruct({crop.width, crop.height, picture.half_a, picture.half_b, picture.samples_a, picture.samples_b,
                      picture.layers[1].values},
                     {.threads = 3});
}

float number_at(const std::string& halves, std::size_t i) {
  return _cvtsh_ss(static_cast<unsigned short>(static_cast<unsigned char>(halves[2 * i]) |
                                               static_cast<unsigned char>(halves[2 * i + 1]) << 8));
}

TEST(DenoisedTiles, AreThePictureOfFetch) {
  const PixelRect crop{40, 70, 150, 61};  // tiles of several sizes
  const std::vector<LayerSpec> layers = *film_layers(std::vector<std::string>(kLayers.begin(), kLayers.end()));
  const Film film = noisy_film(crop, layers);
  const std::vector<float> expected = fetched(film);
  const std::vector<DenoisedTile> tiles = denoised_tiles(snapshot_of(film, *layer_slice(kFeaturesLayer, layers)));
  ASSERT_EQ(tiles.size(), film.grid().picture_tiles());
  ASSERT_GT(tiles.size(), 4u);
  const auto pixels = static_cast<std::size_t>(crop.pixel_count());
  std::size_t seen = 0, other = 0;
  for (std::uint32_t i = 0; i < tiles.size(); ++i) {
    const auto& [rect, samples, values] = tiles[i];
    EXPECT_EQ(rect, film.grid().tile_rect(TileId{i}));
    EXPECT_EQ(samples, film.samples(TileId{i}));
    const auto in_tile = static_cast<std::size_t>(rect.pixel_count());
    ASSERT_EQ(values.size(), 8 * in_tile);
    const std::vector<float> raw = mean_rgb(snapshot(film, TileId{i}));
    for (std::size_t at = 0; at < in_tile; ++at, ++seen) {
      const int x = rect.x - crop.x + static_cast<int>(at) % rect.width;
      const int y = rect.y - crop.y + static_cast<int>(at) / rect.width;
      const std::size_t from = static_cast<std::size_t>(y) * 150 + static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(number_at(values, 4 * at + c), _cvtsh_ss(_cvtss_sh(expected[c * pixels + from], 0)));
      }
      EXPECT_EQ(number_at(values, 4 * at + 3), -1);
      other += raw[at] != expected[from];
    }
  }
  EXPECT_EQ(seen, pixels);
  EXPECT_GT(other, pixels / 2) << "most pixels differ from the raw picture";
}

}  // namespace
}  // namespace lightmill
