#include "common/film/film.h"

#include <gtest/gtest.h>

#include <cctype>
#include <random>

#include "tests/support/film_planes.h"

namespace lightmill {
namespace {

constexpr PixelRect kCrop{60, 0, 10, 3};  // two tiles: 4×3 and 6×3 pixels

/// The value of one sample, a fixed irregular function.
float sample_value(TileId tile, std::size_t slot, std::uint32_t sample) {
  std::mt19937 bits(tile.value * 7919 + static_cast<std::uint32_t>(slot) * 104729 + sample * 1299709 + 1);
  return static_cast<float>(bits()) * 1e-9f + static_cast<float>(bits() % 1000) * 37.0f;
}

/// A worker's result: the tree over the range. The half without the sample has 0.
NodePtr make_node(const Film& film, TileId tile, SampleRange range) {
  if (range.level > 0) {
    return std::make_shared<const Node>(
        join(*make_node(film, tile, range.left_child()), *make_node(film, tile, range.right_child()), film.layout()));
  }
  Node node{range, std::vector<float>(film.expected_values(tile, range), 0.0f), range.index % 7 == 0 ? 1u : 0u};
  const std::size_t half = film.layout().summed * static_cast<std::size_t>(film.grid().tile_rect(tile).pixel_count());
  for (std::size_t i = 0; i < half; ++i) {
    node.values[range.index % 2 * half + i] = sample_value(tile, i, range.index);
  }
  for (std::size_t i = 2 * half; i < node.values.size(); ++i) {
    node.values[i] = i % 5 == range.index % 5 ? 0.0f : sample_value(tile, i, range.index);
  }
  return std::make_shared<const Node>(std::move(node));
}

/// Cuts [first, end) into maximal dyadic ranges.
std::vector<SampleRange> dyadic_cover(std::uint64_t first, std::uint64_t end) {
  std::vector<SampleRange> ranges;
  while (first < end) {
    std::uint32_t level = 0;
    while (first % (std::uint64_t{2} << level) == 0 && first + (std::uint64_t{2} << level) <= end) {
      ++level;
    }
    ranges.push_back({level, static_cast<std::uint32_t>(first >> level)});
    first = ranges.back().end();
  }
  return ranges;
}

std::vector<SampleRange> ranges_of(const Film& film, TileId tile) {
  std::vector<SampleRange> ranges;
  for (const NodePtr& node : film.forest(tile)) {
    ranges.push_back(node->range);
  }
  return ranges;
}

/// Splits ranges at random, as other units would.
std::vector<SampleRange> split_at_random(std::vector<SampleRange> ranges, std::mt19937& bits) {
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    while (ranges[i].level > 0 && bits() % 3 != 0) {
      ranges.push_back(ranges[i].right_child());
      ranges[i] = ranges[i].left_child();
    }
  }
  return ranges;
}

class FilmTest : public testing::TestWithParam<std::vector<std::string>> {
 protected:
  Film make_film() const { return Film(TileGrid(kCrop), NodeLayout(*film_layers(GetParam()))); }
  /// The film with [0, samples) merged in ascending order, one sample at a time.
  Film quiet_film(std::uint32_t samples) const {
    Film film = make_film();
    for (std::uint32_t tile = 0; tile < 2; ++tile) {
      for (std::uint32_t i = 0; i < samples; ++i) {
        film.merge(TileId{tile}, make_node(film, TileId{tile}, {0, i}));
      }
    }
    return film;
  }
  void expect_same_bits(const Film& a, const Film& b) const {
    for (std::uint32_t tile = 0; tile < 2; ++tile) {
      EXPECT_EQ(ranges_of(a, TileId{tile}), ranges_of(b, TileId{tile}));
      const std::vector<float> x = test::sums_of(a, TileId{tile});
      const std::vector<float> y = test::sums_of(b, TileId{tile});
      ASSERT_EQ(x.size(), y.size());
      EXPECT_EQ(std::memcmp(x.data(), y.data(), x.size() * sizeof(float)), 0) << "tile " << tile;
      const auto pixels = static_cast<std::size_t>(a.grid().tile_rect(TileId{tile}).pixel_count());
      EXPECT_EQ(first_over(a.forest(TileId{tile}), a.layout(), pixels).values,
                first_over(b.forest(TileId{tile}), b.layout(), pixels).values);
    }
    EXPECT_EQ(a.non_finite(), b.non_finite());
  }
};

TEST_P(FilmTest, MergeOrderAndSplitDoNotChangeBits) {
  const std::uint32_t seeds = GetParam().empty() ? 200 : 15;  // with layers there is more to compute
  for (std::uint32_t seed = 0; seed < seeds; ++seed) {
    std::mt19937 bits(seed);
    const std::uint32_t samples = 1 + bits() % 70;
    const Film quiet = quiet_film(samples);
    Film film = make_film();
    for (std::uint32_t tile = 0; tile < 2; ++tile) {
      std::vector<SampleRange> ranges = split_at_random(dyadic_cover(0, samples), bits);
      // Some ranges come twice, and some also in another split.
      const std::vector<SampleRange> others = split_at_random(dyadic_cover(0, samples), bits);
      for (const SampleRange& range : others) {
        if (bits() % 4 == 0) {
          ranges.push_back(range);
        }
      }
      std::shuffle(ranges.begin(), ranges.end(), bits);
      for (const SampleRange& range : ranges) {
        const MergeOutcome outcome = film.merge(TileId{tile}, make_node(film, TileId{tile}, range));
        EXPECT_NE(outcome.kind, MergeOutcome::Kind::mismatch);
      }
    }
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << samples << " samples");
    expect_same_bits(quiet, film);
    EXPECT_EQ(film.min_samples(), samples);
    EXPECT_EQ(film.max_samples(), samples);
    EXPECT_EQ(film.pixel_samples(), std::uint64_t{samples} * 30);
  }
}

TEST_P(FilmTest, OutcomesDescribeTheStoredForest) {
  // A set of nodes that follows `removed` and `added` always holds the film's forest, and can restore it.
  for (std::uint32_t seed = 0; seed < (GetParam().empty() ? 50u : 10u); ++seed) {
    std::mt19937 bits(seed);
    Film film = make_film();
    std::map<SampleRange, NodePtr> stored;
    std::vector<SampleRange> ranges = split_at_random(dyadic_cover(0, 64), bits);
    std::shuffle(ranges.begin(), ranges.end(), bits);
    for (const SampleRange& range : ranges) {
      const MergeOutcome outcome = film.merge(TileId{1}, make_node(film, TileId{1}, range));
      for (const SampleRange& removed : outcome.removed) {
        EXPECT_EQ(stored.erase(removed), 1u);
      }
      for (const NodePtr& added : outcome.added) {
        EXPECT_TRUE(stored.emplace(added->range, added).second);
      }
      EXPECT_EQ(stored.size(), film.forest(TileId{1}).size());
      Film restored = make_film();
      for (const auto& [stored_range, node] : stored) {
        restored.restore(TileId{1}, node);
      }
      EXPECT_EQ(ranges_of(restored, TileId{1}), ranges_of(film, TileId{1}));
      EXPECT_EQ(restored.bytes(), film.bytes());
      EXPECT_EQ(restored.non_finite(), film.non_finite());
      EXPECT_EQ(restored.samples(TileId{1}), film.samples(TileId{1}));
    }
  }
}

TEST_P(FilmTest, ExtendingGivesTheBitsOfOneRequest) {
  Film extended = make_film();
  Film at_once = make_film();
  for (std::uint32_t tile = 0; tile < 2; ++tile) {
    const auto merge_all = [&](Film& film, std::uint64_t first, std::uint64_t end) {
      for (const SampleRange& range : dyadic_cover(first, end)) {
        film.merge(TileId{tile}, make_node(film, TileId{tile}, range));
      }
    };
    merge_all(extended, 0, 100);
    merge_all(extended, 100, 300);
    merge_all(at_once, 0, 300);
  }
  expect_same_bits(extended, at_once);
  EXPECT_EQ(ranges_of(at_once, TileId{0}), (std::vector<SampleRange>{{8, 0}, {5, 8}, {3, 36}, {2, 74}}));
}

TEST_P(FilmTest, DropsCoveredNodes) {
  Film film = make_film();
  film.merge(TileId{0}, make_node(film, TileId{0}, {3, 0}));
  const std::uint64_t version = film.version();
  for (const SampleRange& range : {SampleRange{3, 0}, SampleRange{0, 7}, SampleRange{1, 2}}) {
    const MergeOutcome outcome = film.merge(TileId{0}, make_node(film, TileId{0}, range));
    EXPECT_EQ(outcome.kind, MergeOutcome::Kind::duplicate);
    EXPECT_TRUE(outcome.added.empty());
    EXPECT_TRUE(outcome.removed.empty());
  }
  EXPECT_EQ(film.version(), version);
  EXPECT_TRUE(film.covered(TileId{0}, {0, 7}));
  EXPECT_FALSE(film.covered(TileId{0}, {0, 8}));
  EXPECT_FALSE(film.covered(TileId{1}, {0, 7}));
}

TEST_P(FilmTest, AncestorsReplaceTheirDescendants) {
  Film film = make_film();
  film.merge(TileId{0}, make_node(film, TileId{0}, {0, 1}));
  film.merge(TileId{0}, make_node(film, TileId{0}, {1, 3}));
  const MergeOutcome outcome = film.merge(TileId{0}, make_node(film, TileId{0}, {3, 0}));
  EXPECT_EQ(outcome.removed, (std::vector<SampleRange>{{0, 1}, {1, 3}}));
  ASSERT_EQ(outcome.added.size(), 1u);
  EXPECT_EQ(outcome.added[0]->range, (SampleRange{3, 0}));
  EXPECT_EQ(film.samples(TileId{0}), 8u);
}

TEST_P(FilmTest, FindsEqualRangesWithDifferentBits) {
  Film film = make_film();
  // The two siblings join to the parent's range. The parent's own bits must then be equal.
  film.merge(TileId{0}, make_node(film, TileId{0}, {1, 0}));
  film.merge(TileId{0}, make_node(film, TileId{0}, {1, 1}));
  Node wrong = *make_node(film, TileId{0}, {2, 0});
  EXPECT_EQ(film.merge(TileId{0}, std::make_shared<const Node>(wrong)).kind, MergeOutcome::Kind::duplicate);
  wrong.values[5] = std::nextafter(wrong.values[5], 1e30f);
  EXPECT_EQ(film.merge(TileId{0}, std::make_shared<const Node>(wrong)).kind, MergeOutcome::Kind::mismatch);
  expect_same_bits(film, [&] {
    Film right = make_film();
    right.merge(TileId{0}, make_node(right, TileId{0}, {2, 0}));
    return right;
  }());
}

TEST_P(FilmTest, CountsHalves) {
  Film film = make_film();
  film.merge(TileId{0}, make_node(film, TileId{0}, {0, 3}));
  EXPECT_EQ(film.half_counts(TileId{0}).a, 0u);
  EXPECT_EQ(film.half_counts(TileId{0}).b, 1u);
  film.merge(TileId{0}, make_node(film, TileId{0}, {2, 1}));
  film.merge(TileId{0}, make_node(film, TileId{0}, {0, 8}));
  EXPECT_EQ(film.half_counts(TileId{0}).a, 3u);
  EXPECT_EQ(film.half_counts(TileId{0}).b, 3u);
}

const std::vector<std::string> kLayerLists[] = {
    {}, {"direct", "indirect", "albedo"}, {"normal", "depth", "id"}, {"light:key", "normal", "depth", "id"}};
/// "BeautyDirectIndirect…"
std::string name_of_layers(const testing::TestParamInfo<std::vector<std::string>>& info) {
  std::string name = "Beauty";
  for (const std::string& layer : info.param) {
    bool begins = true;
    for (const char letter : layer) {
      if (std::isalnum(static_cast<unsigned char>(letter)) != 0) {
        name += begins ? static_cast<char>(std::toupper(letter)) : letter;
      }
      begins = letter == ':';
    }
  }
  return name;
}
INSTANTIATE_TEST_SUITE_P(Layers, FilmTest, testing::ValuesIn(kLayerLists), name_of_layers);

/// Two pixels of one summed channel and one channel of each other kind; one sample with the given first values.
NodePtr first_node(std::uint32_t sample, float mean, float nearest, float id) {
  Node node{{0, sample}, {1, 1, 1, 1}, 0};
  if (sample < kFirstSamples) {
    node.values.insert(node.values.end(), {mean, 2 * mean, nearest, 0, id, id + 100});
  }
  return std::make_shared<const Node>(std::move(node));
}

TEST(FirstLayers, AreMadeOfSamples0To15AndKeptWhenTheFilmJoins) {
  NodeLayout layout(1);
  layout.first_mean = layout.first_nearest = layout.first_samples = 1;
  Film film(TileGrid({0, 0, 2, 1}), layout);
  const TileId tile{0};
  for (std::uint32_t sample = 0; sample < 64; ++sample) {
    // Sample 9 has pixel 0's nearest value, 5. Samples 0 to 3 see nothing.
    const float nearest = sample < 4 ? 0.0f : sample == 9 ? 5.0f : sample > 15 ? 1.0f : 7.0f + sample;
    film.merge(tile, first_node(sample, 1.0f + sample, nearest, 1.0f + sample));
  }
  ASSERT_EQ(film.forest(tile).size(), 1u);
  const FirstValues first = first_over(film.forest(tile), layout, 2);
  EXPECT_EQ(first.samples, 16u);
  std::vector<float> expected{136, 272, 5, 0};  // 1 + … + 16
  for (int sample = 0; sample < 16; ++sample) {
    expected.insert(expected.end(), {1.0f + sample, 101.0f + sample});
  }
  EXPECT_EQ(first.values, expected);
  EXPECT_EQ(film.expected_values(tile, {0, 0}), 10u);
  EXPECT_EQ(film.expected_values(tile, {2, 1}), 2 * (2 + 2 + 4u));
  EXPECT_EQ(film.expected_values(tile, {10, 0}), 2 * (2 + 2 + 16u));
  EXPECT_EQ(film.expected_values(tile, {0, 16}), 4u);
}

TEST(FilmLayers, HaveOneOrderAndLightGroupsAddTheRest) {
  const auto layers =
      film_layers(std::vector<std::string>{"id", "light:key", "albedo", "depth", "light:fill", "direct"});
  ASSERT_TRUE(layers.ok());
  std::vector<std::string> names;
  for (const LayerSpec& layer : *layers) {
    names.push_back(layer.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"beauty", "direct", "albedo", "light:key", "light:fill", "light:rest",
                                             "depth", "id"}));
  EXPECT_TRUE(check_layers(*layers).ok());
  std::vector<LayerSpec> wrong = *layers;
  std::swap(wrong[1], wrong[2]);
  EXPECT_FALSE(check_layers(wrong).ok());
  wrong = *layers;
  wrong.back().channels = 2;
  EXPECT_FALSE(check_layers(wrong).ok());
  wrong = *layers;
  wrong.erase(wrong.begin());
  EXPECT_FALSE(check_layers(wrong).ok());
  EXPECT_FALSE(check_layers({}).ok());
}

TEST(FilmLayers, BadListsAreRefusedWithTheReason) {
  const auto error = [](std::vector<std::string> names) { return message_of(film_layers(names).status()); };
  EXPECT_EQ(
      error({"normals"}),
      "unknown layer 'normals'. Did you mean 'normal'? Known layers: direct, indirect, caustic, bias, albedo, normal, "
      "features, depth, id, light:NAME for a light group");
  EXPECT_EQ(error({"depth", "id", "depth"}), "layer \"depth\" is named twice");
  EXPECT_NE(error({"light:a b"}), "");
  std::vector<std::string> many;
  for (int i = 0; i < 9; ++i) {
    many.push_back("light:" + std::to_string(i));
  }
  EXPECT_EQ(error(many), "a film has at most 8 light groups, got 9");
}

TEST(TileGrid, MeterTilesFollowThePictureTiles) {
  const TileGrid grid(PixelRect{60, 130, 10, 70}, 2);
  EXPECT_EQ(grid.tile_count(), 6u);
  EXPECT_EQ(grid.picture_tiles(), 4u);
  EXPECT_FALSE(grid.is_meter(TileId{3}));
  EXPECT_TRUE(grid.is_meter(TileId{4}));
  EXPECT_EQ(grid.tile_rect(TileId{5}), (PixelRect{0, 131136, 64, 64}));
  EXPECT_EQ(meter_of(grid.tile_rect(TileId{5})), 1u);
  EXPECT_EQ(grid.pixel_count(), 700u + 2 * 4096u);
}

TEST(TileGrid, ACropHasTheTilesOfTheFullFilm) {
  const TileGrid grid(PixelRect{60, 130, 10, 70});
  EXPECT_EQ(grid.columns(), 2);
  EXPECT_EQ(grid.tile_count(), 4u);
  EXPECT_EQ(grid.tile_rect(TileId{0}), (PixelRect{60, 130, 4, 62}));
  EXPECT_EQ(grid.tile_rect(TileId{1}), (PixelRect{64, 130, 6, 62}));
  EXPECT_EQ(grid.tile_rect(TileId{2}), (PixelRect{60, 192, 4, 8}));
  EXPECT_EQ(grid.tile_rect(TileId{3}), (PixelRect{64, 192, 6, 8}));
}

TEST(Film, FrameSamplesCountWhatAllTilesHave) {
  Film film(TileGrid(kCrop), 3, Allocation::of({-1, 2}).value());
  const TileId quiet{0}, noisy{1};
  film.merge(quiet, make_node(film, quiet, {3, 0}));  // 8: half of 16
  EXPECT_EQ(film.frame_samples(), 0u);
  film.merge(noisy, make_node(film, noisy, {5, 0}));  // 32: four times 8
  EXPECT_EQ(film.frame_samples(), 8u);
  EXPECT_FALSE(film.has_exactly(8));
  film.merge(noisy, make_node(film, noisy, {5, 1}));
  EXPECT_EQ(film.frame_samples(), 16u);
  EXPECT_TRUE(film.has_exactly(16));
  EXPECT_FALSE(film.has_exactly(8));
  film.merge(noisy, make_node(film, noisy, {0, 64}));
  EXPECT_EQ(film.frame_samples(), 16u);
  EXPECT_FALSE(film.has_exactly(16));
  EXPECT_EQ(film.min_samples(), 8u);
  EXPECT_EQ(film.max_samples(), 65u);
}

TEST(Film, DroppedRangesMergeAgainWithTheSameBits) {
  Film film{TileGrid(kCrop), NodeLayout()};
  const TileId tile{1};
  for (const SampleRange range : {SampleRange{2, 0}, SampleRange{0, 4}, SampleRange{1, 3}}) {
    film.merge(tile, make_node(film, tile, range));
  }
  Film whole = film;
  const std::uint64_t version = film.version(tile), bytes = film.bytes(), non_finite = film.non_finite();
  film.drop(tile, {2, 0});
  EXPECT_EQ(ranges_of(film, tile), (std::vector<SampleRange>{{0, 4}, {1, 3}}));
  EXPECT_EQ(film.samples(tile), 3u);
  EXPECT_FALSE(film.covered(tile, {0, 0}));
  EXPECT_GT(film.version(tile), version);
  EXPECT_LT(film.bytes(), bytes);
  EXPECT_LT(film.non_finite(), non_finite);
  EXPECT_EQ(film.pixel_samples(), 3u * static_cast<std::uint64_t>(film.grid().tile_rect(tile).pixel_count()));
  film.drop(tile, {0, 4});
  film.drop(tile, {1, 3});
  EXPECT_EQ(film.max_samples(), 0u);
  EXPECT_EQ(film.bytes(), 0u);
  for (const SampleRange range : {SampleRange{0, 4}, SampleRange{1, 3}, SampleRange{1, 1}, SampleRange{1, 0}}) {
    film.merge(tile, make_node(film, tile, range));
  }
  EXPECT_EQ(test::sums_of(film, tile), test::sums_of(whole, tile));
  EXPECT_EQ(film.non_finite(), whole.non_finite());
}

}  // namespace
}  // namespace lightmill
