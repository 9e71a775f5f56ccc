// Exact lookups of textures by their coordinates.
#include <gtest/gtest.h>

#include <cmath>

#include "common/materials/texture.h"

namespace lightmill::test {
namespace {

/// Red values 0, 1, 2 … row by row from the top; green 10 times that; alpha 0.5.
std::shared_ptr<const Texels> numbered(int width, int height) {
  std::vector<float> values;
  for (int i = 0; i < width * height; ++i) {
    values.insert(values.end(), {static_cast<float>(i), static_cast<float>(10 * i), 0.0f, 0.5f});
  }
  return std::make_shared<Texels>(Texels{width, height, {}, std::move(values), false});
}

float red_at(const Texture& texture, float u, float v) {
  alignas(32) float out[8];
  texture.lookup(F8(u), F8(v), M8(true)).rgb.x.store(out);
  return out[3];
}

Texture nearest(int width, int height, TextureWrap wrap = TextureWrap::repeat) {
  return Texture(numbered(width, height), {TextureFilter::nearest, {wrap, wrap}, false});
}
Texture bilinear(int width, int height, TextureWrap wrap = TextureWrap::repeat) {
  return Texture(numbered(width, height), {TextureFilter::bilinear, {wrap, wrap}, false});
}

TEST(Texture, NearestCountsColumnsToTheRightAndRowsUpwards) {
  const Texture texture = nearest(3, 2);  // 0 1 2 above 3 4 5
  EXPECT_EQ(red_at(texture, 0.1f, 0.1f), 3);
  EXPECT_EQ(red_at(texture, 0.5f, 0.1f), 4);
  EXPECT_EQ(red_at(texture, 0.9f, 0.9f), 2);
  EXPECT_EQ(red_at(texture, 0.1f, 0.51f), 0);
}

TEST(Texture, RepeatedWholeNumbersAreTheLowerLeftCorner) {
  const Texture texture = nearest(3, 2);
  for (const float whole : {-2.0f, -1.0f, 0.0f, 1.0f, 7.0f}) {
    EXPECT_EQ(red_at(texture, whole, whole), 3) << whole;
  }
}

TEST(Texture, ClampedWholeNumbersAreTheCorners) {
  const Texture texture = nearest(3, 2, TextureWrap::clamp);
  EXPECT_EQ(red_at(texture, 0, 0), 3);
  EXPECT_EQ(red_at(texture, 1, 1), 2);
  EXPECT_EQ(red_at(texture, 5, -3), 5);
  EXPECT_EQ(red_at(texture, -5, 3), 0);
}

TEST(Texture, NegativeCoordinatesRepeat) {
  const Texture texture = nearest(3, 2);
  EXPECT_EQ(red_at(texture, -0.1f, -0.1f), red_at(texture, 0.9f, 0.9f));
  EXPECT_EQ(red_at(texture, -3.4f, 0.2f), red_at(texture, 0.6f, 0.2f));
}

TEST(Texture, AnImageOfOneTexelIsConstant) {
  const auto texels = std::make_shared<Texels>(Texels{1, 1, {}, std::vector<float>{7, 8, 9, 1}, false});
  for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear}) {
    for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirror}) {
      const Texture texture(texels, {filter, {wrap, wrap}, false});
      for (const float u : {-1e9f, -1.5f, 0.0f, 0.3f, 1.0f, 1e9f}) {
        EXPECT_EQ(red_at(texture, u, -u), 7);
      }
    }
  }
}

TEST(Texture, BilinearMeetsTexelCentresAndIsLinearBetween) {
  const Texture texture = bilinear(4, 1);
  EXPECT_FLOAT_EQ(red_at(texture, 0.125f, 0.5f), 0);
  EXPECT_FLOAT_EQ(red_at(texture, 0.375f, 0.5f), 1);
  EXPECT_FLOAT_EQ(red_at(texture, 0.25f, 0.5f), 0.5f);
  EXPECT_FLOAT_EQ(red_at(texture, 0.8125f, 0.2f), 2.75f);
}

TEST(Texture, BilinearIsSeamlessWhereItRepeatsAndFlatWhereItIsClamped) {
  // Between the last texel, 3, and the first, 0.
  EXPECT_FLOAT_EQ(red_at(bilinear(4, 1), 0, 0.5f), 1.5f);
  EXPECT_FLOAT_EQ(red_at(bilinear(4, 1), 1, 0.5f), 1.5f);
  EXPECT_FLOAT_EQ(red_at(bilinear(4, 1), -0.0625f, 0.5f), 2.25f);
  EXPECT_FLOAT_EQ(red_at(bilinear(4, 1, TextureWrap::clamp), 0, 0.5f), 0);
  EXPECT_FLOAT_EQ(red_at(bilinear(4, 1, TextureWrap::clamp), 1, 0.5f), 3);
}

// 0 1 2 above 3 4 5. Copies 0, 1, 2 to the right: 0 1 2 2 1 0 0 1 2, and so on to both sides.
TEST(Texture, EverySecondMirroredCopyIsReversed) {
  const Texture texture = nearest(3, 2, TextureWrap::mirror);
  constexpr std::array<float, 6> kTopRow{0, 1, 2, 2, 1, 0};
  for (int i = -12; i < 12; ++i) {
    const float u = (static_cast<float>(i) + 0.5f) / 3;
    const float top = kTopRow[static_cast<std::size_t>((i + 12) % 6)];
    EXPECT_EQ(red_at(texture, u, 0.75f), top) << i;
    EXPECT_EQ(red_at(texture, u, 0.25f), top + 3) << i;
    EXPECT_EQ(red_at(texture, u, 1.25f), top) << i;
    EXPECT_EQ(red_at(texture, u, 1.75f), top + 3) << i;
    EXPECT_EQ(red_at(texture, u, -0.25f), top + 3) << i;
    EXPECT_EQ(red_at(texture, u, -0.75f), top) << i;
  }
}

TEST(Texture, BilinearIsFlatWhereItIsMirrored) {
  const Texture texture = bilinear(4, 1, TextureWrap::mirror);
  for (const float edge : {-4.0f, -2.0f, 0.0f, 2.0f}) {
    EXPECT_FLOAT_EQ(red_at(texture, edge, 0.5f), 0) << edge;
    EXPECT_FLOAT_EQ(red_at(texture, edge + 1, 0.5f), 3) << edge;
    for (const float step : {0.0625f, 0.25f, 0.4375f}) {
      EXPECT_FLOAT_EQ(red_at(texture, edge + step, 0.5f), red_at(texture, edge - step, 0.5f)) << edge << " " << step;
    }
  }
}

TEST(Texture, EachAxisWrapsInItsOwnWay) {
  using enum TextureWrap;
  constexpr std::array kWays{repeat, clamp, mirror};
  // The column at u = 1.1 and the row from below at v = −0.7: of three columns, and of two rows.
  constexpr std::array<float, 3> kColumn{0, 2, 2}, kBelow{0, 0, 1};
  for (std::size_t u = 0; u < 3; ++u) {
    for (std::size_t v = 0; v < 3; ++v) {
      const Texture texture(numbered(3, 2), {TextureFilter::nearest, {kWays[u], kWays[v]}, false});
      EXPECT_EQ(red_at(texture, 1.1f, -0.7f), kColumn[u] + 3 * (1 - kBelow[v])) << u << " " << v;
    }
  }
}

TEST(Texture, TheMatrixMultipliesAndOffsetIsAdded) {
  const Texture texture(numbered(4, 1), {TextureFilter::nearest, {}, false, {{{0.5f, 0}, {0, 1}}}, {0.25f, 0}});
  EXPECT_EQ(red_at(texture, 0, 0), 1);
  EXPECT_EQ(red_at(texture, 0.6f, 0), 2);
  // Its first coordinate is v, its second one 1 − u: 0 1 2 above 3 4 5, turned clockwise.
  const Texture turned(numbered(3, 2), {TextureFilter::nearest, {}, false, {{{0, 1}, {-1, 0}}}, {0, 1}});
  EXPECT_EQ(red_at(turned, 0.1f, 0.1f), 0);
  EXPECT_EQ(red_at(turned, 0.1f, 0.9f), 2);
  EXPECT_EQ(red_at(turned, 0.9f, 0.1f), 3);
}

// Two tiles side by side, and one above the second.
TEST(Texture, TilesCoverSquaresOfTheirOwn) {
  TextureSet set;
  const auto one = [](float value) {
    return std::make_shared<Texels>(Texels{1, 1, {}, std::vector<float>{value, 0, 0, 1}, false});
  };
  const TextureSettings settings{
      TextureFilter::bilinear, {TextureWrap::clamp, TextureWrap::clamp}, false, {{{2, 0}, {0, 2}}}};
  for (const float value : {1.0f, 2.0f, 12.0f}) {
    set.add(Texture(one(value), settings));
  }
  set.set_tile(0, 0, 0);
  set.set_tile(0, 1, 1);
  set.set_tile(0, 11, 2);
  struct Place {
    float u, v, red, alpha;
  };
  for (const auto& [u, v, red, alpha] : {Place{0.25f, 0.25f, 1, 1},
                                         {0.75f, 0.25f, 2, 1},
                                         {0.75f, 0.9f, 12, 1},
                                         {0.25f, 0.75f, 0, 0},
                                         {1.25f, 0.25f, 0, 0},
                                         {-0.25f, 0.25f, 0, 0},
                                         {0.75f, 1.25f, 0, 0},
                                         {0.75f, -0.1f, 0, 0},
                                         {5.1f, 0.25f, 0, 0}}) {
    alignas(32) float red_out[8], alpha_out[8];
    const Texture::Rgba8 found = set.lookup(U8(0u), F8(u), F8(v), M8(true));
    found.rgb.x.store(red_out);
    found.alpha.store(alpha_out);
    EXPECT_EQ(red_out[4], red) << u << ", " << v;
    EXPECT_EQ(alpha_out[4], alpha) << u << ", " << v;
  }
  // Lanes may be on several tiles.
  alignas(32) const float us[8] = {0.1f, 0.6f, 0.1f, 0.6f, 0.6f, 0.1f, -1, 0.6f};
  alignas(32) float reds[8];
  set.lookup(U8(0u), F8::load(us), F8(0.2f), M8(true)).rgb.x.store(reds);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(reds[i], us[i] < 0 ? 0 : us[i] < 0.5f ? 1 : 2) << i;
  }
  EXPECT_EQ(set.mean(0).x, 5);
  EXPECT_EQ(set.mean(1).x, 2) << "an image alone";
}

TEST(Texture, SlopesOfTilesAreThoseOfTheirImages) {
  TextureSet set;
  for (int i = 0; i < 2; ++i) {
    set.add(Texture(numbered(4, 1), {TextureFilter::bilinear, {TextureWrap::clamp, TextureWrap::clamp}}));
  }
  set.set_tile(0, 23, 1);
  alignas(32) float by_u[8];
  set.slopes(U8(0u), F8(3.5f), F8(2.5f), M8(true)).u.rgb.x.store(by_u);
  EXPECT_FLOAT_EQ(by_u[0], 4);
  set.slopes(U8(0u), F8(0.5f), F8(0.5f), M8(true)).u.rgb.x.store(by_u);
  EXPECT_EQ(by_u[0], 0) << "no tile";
}

/// The slopes of red, per unit of u and of v.
std::pair<float, float> slopes_at(const Texture& texture, float u, float v) {
  alignas(32) float by_u[8], by_v[8];
  const Texture::Slopes8 slopes = texture.slopes(F8(u), F8(v), M8(true));
  slopes.u.rgb.x.store(by_u);
  slopes.v.rgb.x.store(by_v);
  return {by_u[3], by_v[3]};
}

// 0 1 2 3 above 4 5 6 7: 4 per unit of u and -8 per unit of v. Across the repeated edges it is back to the first texel.
TEST(Texture, SlopesAreThoseToTheNeighbours) {
  using Slopes = std::pair<float, float>;
  const Texture repeated = bilinear(4, 2);
  EXPECT_EQ(slopes_at(repeated, 0.5f, 0.5f), Slopes(4, -8));
  EXPECT_EQ(slopes_at(repeated, 1, 1), Slopes(-12, 8));
  EXPECT_EQ(slopes_at(nearest(4, 2), 0.5f, 0.5f), Slopes(4, -8));
  EXPECT_EQ(slopes_at(bilinear(4, 2, TextureWrap::clamp), 9, 9), Slopes(0, 0));
  const Texture mirror = bilinear(4, 2, TextureWrap::mirror);
  EXPECT_EQ(slopes_at(mirror, 0, 0), Slopes(0, 0));
  EXPECT_EQ(slopes_at(mirror, 1.5f, 0.5f), Slopes(-4, -8));
  // Halfway between the middles of texels, the mean of two slopes counts.
  EXPECT_EQ(slopes_at(repeated, 0.125f, 0.5f), Slopes((4 - 12) / 2.0f, -8));
  const Texture scaled(numbered(4, 2), {TextureFilter::bilinear, {}, false, {{{-0.5f, 0}, {0, 2}}}, {0.75f, -0.5f}});
  EXPECT_EQ(slopes_at(scaled, 0.5f, 0.5f), Slopes(-2, -16));
  const Texture sheared(numbered(4, 2), {TextureFilter::bilinear, {}, false, {{{1, 2}, {0, 1}}}, {-1, 0}});
  EXPECT_EQ(slopes_at(sheared, 0.5f, 0.5f), Slopes(4, 2 * 4 - 8));
  const Texture far_away(numbered(4, 2), {TextureFilter::bilinear, {}, false, {{{1, 0}, {0, 1}}}, {1024, 1e9f}});
  EXPECT_EQ(slopes_at(far_away, 0.5f, 0.5f), Slopes(4, 0));
}

TEST(Texture, DecodingFollowsTheStandard) {
  for (int i = 0; i < 256; ++i) {
    const double x = i / 255.0;
    const double exact = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(srgb_decode_fixed(x), exact, 1e-12) << i;
  }
}

TEST(Texture, BytesAreDecodedAndAlphaIsNot) {
  const std::vector<std::uint32_t> bytes{188u | 0u << 8 | 255u << 16 | 51u << 24};
  const auto texels = std::make_shared<Texels>(Texels{1, 1, bytes, {}, true});
  const Texture texture(texels, {TextureFilter::nearest, {}, true});
  const Texture::Rgba8 found = texture.lookup(F8(0.5f), F8(0.5f), M8(true));
  alignas(32) float red[8], blue[8], alpha[8];
  found.rgb.x.store(red);
  found.rgb.z.store(blue);
  found.alpha.store(alpha);
  EXPECT_NEAR(red[0], std::pow((188 / 255.0 + 0.055) / 1.055, 2.4), 1e-7);
  EXPECT_EQ(blue[0], 1);
  EXPECT_FLOAT_EQ(alpha[0], 0.2f);
  EXPECT_NEAR(texture.mean().x, red[0], 1e-7);
}

TEST(Texture, LanesMayAskForDifferentImagesOrNone) {
  TextureSet set;
  set.add(nearest(1, 1));
  set.add(nearest(2, 1));
  const U8 lane = U8::lane_index();
  const U8 which = select(lane == U8(1u), U8(TextureSet::kNone), (lane & U8(1u)) ^ U8(1u));
  alignas(32) float red[8];
  set.lookup(which, F8(0.75f), F8(0.5f), M8(true)).rgb.x.store(red);
  EXPECT_EQ(red[0], 1);  // the second image's second texel
  EXPECT_EQ(red[1], 1);  // none: white
  EXPECT_EQ(red[3], 0);  // the first image
}

}  // namespace
}  // namespace lightmill::test
