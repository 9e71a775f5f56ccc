#include "common/film/film_hash.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

/// Two pixels of one channel, with three samples each.
struct SmallFilm {
  std::vector<float> mean_a{1, 2}, mean_b{10, 20};
  std::vector<std::uint32_t> counts{3, 3};
  std::vector<float> layer;
  std::vector<Hash128> meters;
  Hash128 hash() const { return film_hash({mean_a, mean_b, counts, {layer}, meters}); }
};

TEST(FilmHash, IsTheXxh3OfMeansAndCountsInOrder) {
  const std::array<std::uint32_t, 6> words{std::bit_cast<std::uint32_t>(1.0f),
                                           std::bit_cast<std::uint32_t>(2.0f),
                                           std::bit_cast<std::uint32_t>(10.0f),
                                           std::bit_cast<std::uint32_t>(20.0f),
                                           3,
                                           3};
  EXPECT_EQ(SmallFilm().hash(), xxh3_128(std::as_bytes(std::span(words))));
}

TEST(FilmHash, CoversLayersAndMeters) {
  const Hash128 plain = SmallFilm().hash();
  SmallFilm layered;
  layered.layer = {1, 2};
  const Hash128 with_layers = layered.hash();
  EXPECT_NE(with_layers, plain);
  layered.layer[1] = 3;
  EXPECT_NE(layered.hash(), with_layers);
  SmallFilm metered;
  const std::vector<float> sums{1, 2};
  metered.meters = {meter_hash(sums, 1, 0)};
  EXPECT_NE(metered.hash(), plain);
  EXPECT_NE(meter_hash(sums, 1, 0), meter_hash(sums, 0, 1));
}

TEST(FilmHash, ChangesWithOnePixelOneCountOrSwappedHalves) {
  const Hash128 expected = SmallFilm().hash();
  SmallFilm other;
  other.mean_b[1] = std::nextafter(20.0f, 21.0f);
  EXPECT_NE(other.hash(), expected);
  other = {};
  other.counts[0] = 4;
  EXPECT_NE(other.hash(), expected);
  other = {};
  std::swap(other.mean_a, other.mean_b);
  EXPECT_NE(other.hash(), expected);
}

}  // namespace
}  // namespace lightmill
