#include "server/assembly/tile_snapshot.h"

#include <gtest/gtest.h>

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
  EXPECT_EQ(sums_of(tile), film.sums(TileId{0}));
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
  EXPECT_EQ(sums_of(snapshot(film, TileId{0})), film.sums(TileId{0}));
}

TEST(TileSnapshot, WhatTheFilmDoesNextDoesNotTouchIt) {
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

TEST(TileSnapshot, WhatNoHalfHoldsIsTheLargest) {
  Film film(TileGrid({0, 0, 2, 1}), 3);
  film.merge(TileId{0}, node(0, 0, 1e9f, 0));
  EXPECT_EQ(first_halves(snapshot(film, TileId{0})), (std::vector<unsigned>{0x7bff, 0x7bff, 0x7bff, 0xbc00}));
}

}  // namespace
}  // namespace lightmill
