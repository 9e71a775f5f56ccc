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

}  // namespace
}  // namespace lightmill
