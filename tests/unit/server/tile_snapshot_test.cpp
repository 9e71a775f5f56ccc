#include "server/assembly/tile_snapshot.h"

#include <gtest/gtest.h>
#include <immintrin.h>

#include "tests/support/film_planes.h"

namespace lightmill {
namespace {

/// A node of 2×1 pixels and three channels whose half A is `a` and half B is `b` everywhere.
std::shared_ptr<const Node> node(std::uint32_t level, std::uint32_t index, float a, float b) {
  auto made = std::make_shared<Node>();
  made->range = {level, index};
  made->values.assign(12, b);
  std::fill_n(made->values.begin(), 6, a);
  return made;
}

TEST(TileSnapshot, AnEmptyTileIsBlack) {
  const Film film(TileGrid({0, 0, 2, 1}), 3);
  const TileSnapshot tile = snapshot(film, TileId{0});
  EXPECT_EQ(mean_rgb(tile), std::vector<float>(6, 0.0f));
  EXPECT_EQ(sums_of(tile), test::sums_of(film, TileId{0}));
}

TEST(TileSnapshot, TheMeanIsThatOfAllSamplesOfBothHalves) {
  Film film(TileGrid({0, 0, 2, 1}), 3);
  film.merge(TileId{0}, node(1, 0, 3, 5));
  film.merge(TileId{0}, node(0, 2, 4, 0));
  const TileSnapshot tile = snapshot(film, TileId{0});
  EXPECT_EQ(tile.samples, 3u);
  EXPECT_EQ(tile.samples_a, 2u);
  EXPECT_EQ(mean_rgb(tile), std::vector<float>(6, 4.0f));
}

TEST(TileSnapshot, SumsHaveTheBitsOfTheFilm) {
  Film film(TileGrid({0, 0, 2, 1}), 3);
  film.merge(TileId{0}, node(2, 0, 1e8f, 0.1f));
  film.merge(TileId{0}, node(1, 2, 1.3f, 1e-9f));
  film.merge(TileId{0}, node(0, 6, -1e8f, 0));
  EXPECT_EQ(sums_of(snapshot(film, TileId{0})), test::sums_of(film, TileId{0}));
}

TEST(TileSnapshot, LaterMergesDoNotChangeIt) {
  Film film(TileGrid({0, 0, 2, 1}), 3);
  film.merge(TileId{0}, node(0, 0, 4, 0));
  const TileSnapshot before = snapshot(film, TileId{0});
  film.merge(TileId{0}, node(0, 1, 0, 8));
  EXPECT_EQ(before.samples, 1u);
  EXPECT_EQ(mean_rgb(before), std::vector<float>(6, 4.0f));
}

/// The halves of the first pixel.
std::vector<unsigned> first_halves(const TileSnapshot& tile) {
  const std::string bytes = view_pixels(tile);
  EXPECT_EQ(bytes.size(), 8u * static_cast<std::size_t>(tile.rect.pixel_count()));
  std::vector<unsigned> halves;
  for (std::size_t i = 0; i < 8; i += 2) {
    halves.push_back(static_cast<unsigned char>(bytes[i]) | static_cast<unsigned char>(bytes[i + 1]) << 8);
  }
  return halves;
}

TEST(TileSnapshot, APageGetsTheMeanAndTheErrorOfItsPixels) {
  Film film(TileGrid({0, 0, 2, 1}), 3);
  EXPECT_EQ(first_halves(snapshot(film, TileId{0})), (std::vector<unsigned>{0, 0, 0, 0xbc00})) << "-1: not known";
  film.merge(TileId{0}, node(1, 0, 3, 5));
  film.merge(TileId{0}, node(0, 2, 4, 0));
  // Halves of 2 samples with mean 3.5 and of 1 with 5: 4 ± 1.5 √2 / 3, whose half is 0x39a8.
  EXPECT_EQ(first_halves(snapshot(film, TileId{0})), (std::vector<unsigned>{0x4400, 0x4400, 0x4400, 0x39a8}));
}

TEST(TileSnapshot, EachLayerHasItsOwnValues) {
  const std::vector<std::string> names{"direct", "light:key", "normal", "depth", "id"};
  const std::vector<LayerSpec> layers = film_layers(names).value();
  const NodeLayout layout(layers);
  Film film(TileGrid({0, 0, 1, 1}), layout);
  for (const std::uint32_t index : {0u, 1u}) {
    auto made = std::make_shared<Node>();
    made->range = {0, index};
    // Halves of beauty, direct, the group and the rest; then a normal, a depth and an id.
    const std::size_t mine = index == 0 ? 0 : layout.summed;
    made->values.assign(layout.values(made->range), 0.0f);
    for (std::size_t i = 0; i < layout.summed; ++i) {
      made->values[mine + i] = static_cast<float>(i + 1) * (index == 0 ? 1.0f : 3.0f);
    }
    const std::vector<float> first{0.5f, -1, 0.25f, index == 0 ? 8.0f : 2.0f, 77};
    std::ranges::copy(first, made->values.end() - 5);
    film.merge(TileId{0}, made);
  }
  const TileSnapshot tile = snapshot(film, TileId{0});
  const auto shown = [&](std::string_view layer) {
    const std::string bytes = view_pixels(tile, layer_slice(layer, layers).value());
    std::vector<float> values;
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
      values.push_back(_cvtsh_ss(static_cast<std::uint16_t>(static_cast<unsigned char>(bytes[i]) |
                                                            static_cast<unsigned char>(bytes[i + 1]) << 8)));
    }
    return values;
  };
  // Halves of one sample each, a and 3a: their mean is 2a, and its error |a − 3a| / 2.
  const auto of = [](float r, float g, float b) {
    const float light = 0.2126f * r + 0.7152f * g + 0.0722f * b;
    return std::vector<float>{2 * r, 2 * g, 2 * b, light};
  };
  for (const auto& [layer, first] :
       {std::pair{"beauty", 1.0f}, {"direct", 4.0f}, {"light:key", 7.0f}, {"light:rest", 10.0f}}) {
    const std::vector<float> expected = of(first, first + 1, first + 2), got = shown(layer);
    ASSERT_EQ(got.size(), 4u) << layer;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(got[i], expected[i], expected[i] / 1024) << layer;
    }
  }
  EXPECT_EQ(shown("normal"), (std::vector<float>{0.5f, -1, 0.25f, -1}));
  EXPECT_EQ(shown("depth"), (std::vector<float>{2, 2, 2, -1}));
  EXPECT_TRUE(shown("id").empty()) << "no colours";
  EXPECT_FALSE(layer_slice("albedo", layers));
}

TEST(TileSnapshot, ValuesBeyondHalfPrecisionBecomeTheLargest) {
  Film film(TileGrid({0, 0, 2, 1}), 3);
  film.merge(TileId{0}, node(0, 0, 1e9f, 0));
  EXPECT_EQ(first_halves(snapshot(film, TileId{0})), (std::vector<unsigned>{0x7bff, 0x7bff, 0x7bff, 0xbc00}));
}

}  // namespace
}  // namespace lightmill
