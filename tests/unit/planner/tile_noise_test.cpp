#include "common/planner/tile_noise.h"

#include <gtest/gtest.h>

#include "common/methods/method.h"
#include "tests/analytic/scene_text.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

using test::also;
using test::diffuse;
using test::document;
using test::mesh;
using test::polygon;
using test::sphere;

/// 256×128 pixels, two rows of four tiles. The left tiles see a black floor, the right ones a grey floor under a large
/// emitter.
test::TestScene half_dark() {
  return test::TestScene::from_text(
             document(
                 R"("eye": [0, 2, 4], "look_at": [0, 0, 0])", 40, 256,
                 diffuse("black", 0) + also(diffuse("floor", 0.5)) + also(diffuse("lamp", 0, 1)),
                 mesh("black", "left.obj") + also(mesh("floor", "right.obj")) + also(sphere("lamp", "[3, 4, -1]", 2))),
             {{"left.obj", polygon({{-50, 0, 50}, {0, 0, 50}, {0, 0, -50}, {-50, 0, -50}})},
              {"right.obj", polygon({{0, 0, 50}, {50, 0, 50}, {50, 0, -50}, {0, 0, -50}})}})
      .resized(256, 128);
}

std::vector<std::int8_t> shifts_of(const AllocationResult& result) {
  return {result.allocation.shifts().begin(), result.allocation.shifts().end()};
}

TEST(TileNoise, PatchesLieInTheMiddleOfCells) {
  const std::vector<PixelRect> patches = noise_patches({64, 128, 64, 64}, 8);
  ASSERT_EQ(patches.size(), 64u);
  EXPECT_EQ(patches[0], (PixelRect{67, 131, 2, 2}));
  EXPECT_EQ(patches[63], (PixelRect{64 + 59, 128 + 59, 2, 2}));
  EXPECT_EQ(noise_patches({0, 0, 1, 1}, 8), (std::vector<PixelRect>{{0, 0, 1, 1}}));
  EXPECT_EQ(noise_patches({5, 7, 11, 1}, 8), (std::vector<PixelRect>{{8, 7, 2, 1}, {13, 7, 2, 1}}));
  EXPECT_EQ(noise_patches({64, 0, 64, 64}, 64), (std::vector<PixelRect>{{64 + 31, 31, 2, 2}}));
}

TEST(TileNoise, LargePicturesTakeNoMorePixels) {
  const std::int64_t most = TileNoiseSettings{}.most_pixels;
  for (const auto& [width, height] : {std::pair{1, 1},
                                      {640, 480},
                                      {1024, 1024},
                                      {1920, 1080},
                                      {3840, 2160},
                                      {4001, 2999},
                                      {8192, 8192},
                                      {kMaxFilmSide, 1},
                                      {16384, 16384}}) {
    const TileGrid grid({0, 0, width, height}, 3);
    std::int64_t pixels = 0;
    for (std::uint32_t tile = 0; tile < grid.picture_tiles(); ++tile) {
      const auto patches = noise_patches(grid.tile_rect(TileId{tile}), noise_cell_side(grid.crop(), most));
      EXPECT_FALSE(patches.empty());
      for (const PixelRect& patch : patches) {
        pixels += patch.pixel_count();
      }
    }
    const std::int64_t edges = (width + height) / 8 * 4 + 8;  // cells cut off there also have a patch
    EXPECT_LE(pixels, std::max(most, std::int64_t{4} * grid.picture_tiles()) + edges) << width;
    EXPECT_GE(4 * pixels, std::min(most, std::int64_t{width} * height / 16)) << width << ": nor much fewer";
  }
}

TEST(TileNoise, TilesOfARegionShareAnEstimate) {
  // So few pixels that each half of the picture, 2×2 tiles, is one region.
  const AllocationResult result =
      find_allocation(half_dark().compiled(), {"path", 3, 0, TileGrid({0, 0, 256, 128}, 1), 1 << 10}).value();
  ASSERT_EQ(shifts_of(result).size(), 9u);
  for (const std::uint32_t tile : {0u, 1u, 4u, 5u}) {
    EXPECT_LT(result.allocation.shift(TileId{tile}), 0) << "black, " << tile;
    EXPECT_GE(result.allocation.shift(TileId{tile + 2}), 0) << "lit, " << tile;
  }
}

TEST(TileNoise, BlackTilesGiveTheirSamplesToTheOthers) {
  const auto scene = half_dark().compiled();
  const TileGrid grid({0, 0, 256, 128}, 1);
  const AllocationResult path = find_allocation(scene, {"path", 3, 0, grid}).value();
  ASSERT_EQ(shifts_of(path).size(), 9u);
  for (const std::uint32_t row : {0u, 1u}) {
    EXPECT_LT(path.allocation.shift(TileId{4 * row}), 0) << "black, row " << row;
    EXPECT_GE(path.allocation.shift(TileId{4 * row + 3}), 0) << "lit, row " << row;
  }
  EXPECT_GT(std::ranges::max(shifts_of(path)), 0);
  EXPECT_EQ(path.allocation.shift(TileId{8}), 0) << "the meter's";
  EXPECT_EQ(find_allocation(scene, {"path", 3, 0, grid})->allocation, path.allocation);
  EXPECT_NE(describe(path).find("times the mean"), std::string::npos) << describe(path);
}

TEST(TileNoise, ANoiselessPictureHasAUniformAllocation) {
  const auto scene = half_dark().compiled();
  const AllocationResult result = find_allocation(scene, {"preview", 3, 0, TileGrid({0, 0, 64, 64})}).value();
  EXPECT_TRUE(result.allocation.even());
  EXPECT_EQ(result.gain, 1);
}

TEST(TileNoise, AStoppedSearchReturnsCancelled) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(find_allocation(half_dark().compiled(), {"path", 3, 0, TileGrid({0, 0, 256, 128})}, source.get_token())
                .status()
                .code(),
            StatusCode::kCancelled);
}

}  // namespace
}  // namespace lightmill
