#include "common/film/film_hash.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

/// A 2×1 film of one channel at (5, 7), one tile, three samples a pixel: two in half A, one in half B.
FilmPlanes small_film() {
  FilmPlanes planes({5, 7, 2, 1}, 1);
  const std::vector<float> sums{2, 4, 10, 20};
  planes.set_tile({5, 7, 2, 1}, sums, 2, 1);
  return planes;
}

TEST(FilmHash, MeansAreSumsOverTheCountOfTheirHalf) {
  const FilmPlanes planes = small_film();
  EXPECT_EQ(planes.mean_a, (std::vector<float>{1, 2}));
  EXPECT_EQ(planes.mean_b, (std::vector<float>{10, 20}));
  EXPECT_EQ(planes.counts, (std::vector<std::uint32_t>{3, 3}));
}

TEST(FilmHash, IsTheXxh3OfMeansAndCountsInOrder) {
  const std::array<std::uint32_t, 6> words{std::bit_cast<std::uint32_t>(1.0f),
                                           std::bit_cast<std::uint32_t>(2.0f),
                                           std::bit_cast<std::uint32_t>(10.0f),
                                           std::bit_cast<std::uint32_t>(20.0f),
                                           3,
                                           3};
  EXPECT_EQ(film_hash(small_film()), xxh3_128(std::as_bytes(std::span(words))));
}

TEST(FilmHash, AHalfWithoutSamplesHasMeanZero) {
  FilmPlanes planes({0, 0, 1, 1}, 1);
  planes.set_tile({0, 0, 1, 1}, std::vector<float>{3, 0}, 1, 0);
  EXPECT_EQ(planes.mean_a, std::vector<float>{3});
  EXPECT_EQ(planes.mean_b, std::vector<float>{0});
}

TEST(FilmHash, DoesNotDependOnTheSplitOfTheFilm) {
  const PixelRect crop{0, 0, 4, 2};
  FilmPlanes whole(crop, 3);
  std::vector<float> sums(2 * 3 * 8);
  std::iota(sums.begin(), sums.end(), 1.0f);
  whole.set_tile(crop, sums, 4, 4);

  FilmPlanes cut(crop, 3);
  for (const int x : {2, 0}) {
    std::vector<float> part;
    for (std::size_t plane = 0; plane < 6; ++plane) {
      for (int row = 0; row < 2; ++row) {
        for (int column = x; column < x + 2; ++column) {
          part.push_back(sums[plane * 8 + static_cast<std::size_t>(row * 4 + column)]);
        }
      }
    }
    cut.set_tile({x, 0, 2, 2}, part, 4, 4);
  }
  EXPECT_EQ(film_hash(cut), film_hash(whole));
}

TEST(FilmHash, CoversLayersAndMeters) {
  const Hash128 plain = film_hash(small_film());
  FilmPlanes layered = small_film();
  layered.layers = {1, 2};
  const Hash128 with_layers = film_hash(layered);
  EXPECT_NE(with_layers, plain);
  layered.layers[1] = 3;
  EXPECT_NE(film_hash(layered), with_layers);
  FilmPlanes metered = small_film();
  const std::vector<float> sums{1, 2};
  metered.meters = {meter_hash(sums, 1, 0)};
  EXPECT_NE(film_hash(metered), plain);
  EXPECT_NE(meter_hash(sums, 1, 0), meter_hash(sums, 0, 1));
}

TEST(FilmHash, ChangesWithOnePixelOneCountOrSwappedHalves) {
  const Hash128 expected = film_hash(small_film());
  FilmPlanes other = small_film();
  other.mean_b[1] = std::nextafter(20.0f, 21.0f);
  EXPECT_NE(film_hash(other), expected);
  other = small_film();
  other.counts[0] = 4;
  EXPECT_NE(film_hash(other), expected);
  other = small_film();
  std::swap(other.mean_a, other.mean_b);
  EXPECT_NE(film_hash(other), expected);
}

}  // namespace
}  // namespace lightmill
