// Smaller copies of textures, and the footprints that choose between them.
#include <gtest/gtest.h>

#include <cmath>

#include "common/materials/texture.h"
#include "common/methods/camera_rays.h"
#include "common/methods/texture_footprint.h"
#include "common/sampling/sobol.h"
#include "tests/support/render_document.h"

namespace lightmill::test {
namespace {

/// Hashed bytes, with hashed alpha.
std::shared_ptr<const Texels> random_bytes(int width, int height) {
  std::vector<std::uint32_t> bytes;
  for (int i = 0; i < width * height; ++i) {
    bytes.push_back(mix(static_cast<std::uint32_t>(i) + 77));
  }
  return std::make_shared<Texels>(Texels{width, height, std::move(bytes), {}, true});
}

/// Hashed values in [0, 1).
std::shared_ptr<const Texels> random_floats(int width, int height) {
  std::vector<float> values;
  for (int i = 0; i < 4 * width * height; ++i) {
    values.push_back(static_cast<float>(mix(static_cast<std::uint32_t>(i)) >> 8) * 0x1p-24f);
  }
  return std::make_shared<Texels>(Texels{width, height, {}, std::move(values), false});
}

/// Hashed 16-bit integers, or half floats in [0, 1].
std::shared_ptr<const Texels> random_words(int width, int height, bool half) {
  std::vector<std::uint64_t> words;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(width * height); ++i) {
    std::uint64_t word = 0;
    for (std::uint32_t channel = 0; channel < 4; ++channel) {
      const std::uint32_t hashed = mix(4 * i + channel) & 0xffff;
      word |= std::uint64_t{half ? hashed % 0x3c01 : hashed} << (16 * channel);
    }
    words.push_back(word);
  }
  return std::make_shared<Texels>(Texels{width, height, {}, {}, false, std::move(words), half});
}

Texture with_pyramid(Texture texture, TexturePyramid::Weight weight = TexturePyramid::Weight::area) {
  texture.use_pyramid(std::make_shared<const TexturePyramid>(texture.make_pyramid(weight)));
  return texture;
}

float red_at(const Texture& texture, float u, float v, float footprint) {
  alignas(32) float out[8];
  texture.lookup(F8(u), F8(v), F8(footprint), M8(true)).rgb.x.store(out);
  return out[5];
}

/// Size and first texel of a level.
std::array<std::uint32_t, 3> level_of(const TexturePyramid& pyramid, std::uint32_t level) {
  alignas(32) std::uint32_t width[8], height[8], first[8];
  const TexturePyramid::Level8 found = pyramid.at(U8(level), M8(true));
  found.width.store(width);
  found.height.store(height);
  found.first.store(first);
  return {width[0], height[0], first[0]};
}

TEST(TexturePyramid, HalvesRoundedUpToOneTexel) {
  const TexturePyramid pyramid(*random_floats(13, 2), false, TexturePyramid::Weight::area);
  ASSERT_EQ(pyramid.levels(), 4u);
  EXPECT_EQ(level_of(pyramid, 1), (std::array<std::uint32_t, 3>{7, 1, 0}));
  EXPECT_EQ(level_of(pyramid, 2), (std::array<std::uint32_t, 3>{4, 1, 7}));
  EXPECT_EQ(level_of(pyramid, 3), (std::array<std::uint32_t, 3>{2, 1, 11}));
  EXPECT_EQ(level_of(pyramid, 4), (std::array<std::uint32_t, 3>{1, 1, 13}));
  EXPECT_EQ(pyramid.texels().floats.size(), 4u * 14);
  EXPECT_EQ(pyramid_bytes(13, 2, 16), 16u * 14);
  EXPECT_EQ(pyramid_peak_bytes(13, 2, 4), 4u * 14 + 16 * (7 + 4));
  EXPECT_EQ(TexturePyramid(*random_floats(1, 1), false, TexturePyramid::Weight::area).levels(), 0u);
}

/// The integral of one channel over [x0, x1] × [y0, y1], in texels from the upper left corner, over its area.
double mean_of(const Texels& image, std::size_t channel, double x0, double x1, double y0, double y1) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double wide = std::min(x1, x + 1.0) - std::max(x0, 1.0 * x);
      const double high = std::min(y1, y + 1.0) - std::max(y0, 1.0 * y);
      if (wide > 0 && high > 0) {
        sum += wide * high * image.floats[4 * static_cast<std::size_t>(y * image.width + x) + channel];
      }
    }
  }
  return sum / ((x1 - x0) * (y1 - y0));
}

TEST(TexturePyramid, TexelsAreMeansOverTheirAreas) {
  // Below a level of an odd size, texels share neighbours. So only the first level, and the last, are exact there.
  for (const auto& [width, height] : {std::pair{16, 8}, {5, 3}, {7, 1}, {1, 6}, {33, 20}}) {
    const auto image = random_floats(width, height);
    const TexturePyramid pyramid(*image, false, TexturePyramid::Weight::area);
    const bool powers =
        std::has_single_bit(static_cast<unsigned>(width)) && std::has_single_bit(static_cast<unsigned>(height));
    for (std::uint32_t level = 1; level <= pyramid.levels(); ++level) {
      if (!powers && level > 1 && level < pyramid.levels()) {
        continue;
      }
      const auto [w, h, first] = level_of(pyramid, level);
      const double wide = static_cast<double>(width) / w, high = static_cast<double>(height) / h;
      for (std::uint32_t y = 0; y < h; ++y) {
        for (std::uint32_t x = 0; x < w; ++x) {
          for (std::size_t channel = 0; channel < 4; ++channel) {
            const double expected = mean_of(*image, channel, x * wide, (x + 1) * wide, y * high, (y + 1) * high);
            EXPECT_NEAR(pyramid.texels().floats[4 * (first + y * w + x) + channel], expected, 1e-6)
                << width << "x" << height << " level " << level << " at " << x << ", " << y;
          }
        }
      }
    }
  }
}

// Reflectances are clamped to [0, 1] at each texel, so their mean is that of clamped values.
TEST(TexturePyramid, ColoursAreClampedBeforeTheirMean) {
  const Texels image{2, 1, {}, std::vector<float>{100, 0.5f, -3, 1, 0, 0.5f, 0.25f, 1}, false};
  const SharedArray<float> mean = TexturePyramid(image, false, TexturePyramid::Weight::area).texels().floats;
  EXPECT_EQ(mean, (std::vector<float>{0.5f, 0.5f, 0.125f, 1}));
}

TEST(TexturePyramid, BytesRoundToTheNearestLinearColour) {
  const Texture texture(random_bytes(6, 4), {TextureFilter::bilinear, {}, true});
  const TexturePyramid pyramid = texture.make_pyramid(TexturePyramid::Weight::area);
  const auto linear = [](std::uint32_t byte) { return srgb_decode_fixed(byte / 255.0); };
  for (std::uint32_t y = 0; y < 2; ++y) {
    for (std::uint32_t x = 0; x < 3; ++x) {
      for (const std::uint32_t shift : {0u, 8u, 16u, 24u}) {
        double mean = 0;
        for (const std::uint32_t from : {12 * y + 2 * x, 12 * y + 2 * x + 1, 12 * y + 6 + 2 * x, 12 * y + 7 + 2 * x}) {
          const std::uint32_t byte = texture.texels().bytes[from] >> shift & 255;
          mean += (shift == 24 ? byte / 255.0 : linear(byte)) / 4;
        }
        const std::uint32_t got = pyramid.texels().bytes[3 * y + x] >> shift & 255;
        const auto error = [&](std::uint32_t byte) {
          return std::abs((shift == 24 ? byte / 255.0 : linear(byte)) - mean);
        };
        EXPECT_LE(error(got), (got > 0 ? error(got - 1) : 1) + 1e-6) << x << ", " << y << ", " << shift;
        EXPECT_LE(error(got), (got < 255 ? error(got + 1) : 1) + 1e-6) << x << ", " << y << ", " << shift;
      }
    }
  }
}

/// The value of a 16-bit float, by its definition (IEEE 754).
double half_value(std::uint32_t bits) {
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const double fraction = (bits & 1023) / 1024.0, sign = bits >> 15 == 0 ? 1 : -1;
  return sign * (exponent == 0 ? std::ldexp(fraction, -14) : std::ldexp(1 + fraction, exponent - 15));
}

TEST(Texture, WordsStandForIntegersOrHalfFloats) {
  for (const bool half : {false, true}) {
    for (const bool decode : {false, true}) {
      const auto image = random_words(9, 1, half);
      const Texture texture(image, {TextureFilter::nearest, {}, decode});
      for (std::size_t x = 0; x < 9; ++x) {
        const auto value = [&](std::size_t channel) {
          const std::uint32_t bits = component(*image, x, channel);
          return half ? half_value(bits) : bits / 65535.0;
        };
        const auto color = [&](std::size_t channel) {
          return decode ? srgb_decode_fixed(value(channel)) : value(channel);
        };
        const Texture::Rgba8 found = texture.lookup(F8((static_cast<float>(x) + 0.5f) / 9), F8(0.5f), M8(true));
        alignas(32) float out[4][8];
        found.rgb.x.store(out[0]);
        found.rgb.y.store(out[1]);
        found.rgb.z.store(out[2]);
        found.alpha.store(out[3]);
        for (std::size_t channel = 0; channel < 3; ++channel) {
          EXPECT_EQ(out[channel][2], static_cast<float>(color(channel))) << half << decode << x;
        }
        EXPECT_EQ(out[3][2], static_cast<float>(value(3))) << half << decode << x;
      }
    }
  }
  EXPECT_EQ(texel_values(*random_words(1, 1, true), false)[0xc100], -2.5f);
  EXPECT_EQ(texel_values(*random_words(1, 1, true), false)[0x7bff], 65504);
  EXPECT_EQ(texel_values(*random_words(1, 1, true), true)[0xc100], 0) << "clamped";
  EXPECT_EQ(texel_values(*random_words(1, 1, true), true)[0x7bff], 1) << "clamped";
}

TEST(TexturePyramid, WordsRoundToTheNearestValue) {
  for (const bool half : {false, true}) {
    for (const bool decode : {false, true}) {
      const auto image = random_words(4, 2, half);
      const Texture texture(image, {TextureFilter::bilinear, {}, decode});
      const TexturePyramid pyramid = texture.make_pyramid(TexturePyramid::Weight::area);
      EXPECT_EQ(size_bytes(pyramid.texels()), pyramid_bytes(4, 2, 8));
      const std::span<const float> values = texel_values(*image, decode);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        double mean = 0;
        for (std::size_t pixel = 0; pixel < 8; ++pixel) {
          mean += values[component(*image, pixel, channel)] / 8.0;
        }
        // The last level: at most one rounding, because levels are computed before they are rounded.
        const std::uint32_t word = component(pyramid.texels(), 2, channel);
        const double half_step = std::max(values[word + 1] - values[word], values[word] - values[word - 1]) / 2;
        EXPECT_NEAR(values[word], mean, half_step + 1e-6) << half << decode << channel;
      }
    }
  }
}

// A bright leaf on black.
TEST(TexturePyramid, CutOutShapesKeepTheirColour) {
  const auto image = std::make_shared<Texels>(
      Texels{4, 1, {}, std::vector<float>{0, 0, 0, 0, 0.8f, 0.4f, 0.2f, 1, 0.3f, 0, 0, 0, 0.5f, 0, 0, 0}, false});
  const auto red = [&](TexturePyramid::Weight weight, std::size_t texel) {
    return TexturePyramid(*image, false, weight).texels().floats[4 * texel];
  };
  EXPECT_NEAR(red(TexturePyramid::Weight::area, 0), 0.4f, 1e-6f);
  EXPECT_NEAR(red(TexturePyramid::Weight::alpha, 0), 0.8f, 1e-5f);
  EXPECT_NEAR(red(TexturePyramid::Weight::alpha, 1), 0.4f, 1e-6f) << "all transparent: the plain mean";
  EXPECT_NEAR(red(TexturePyramid::Weight::alpha, 2), 0.8f, 1e-5f);
  EXPECT_EQ(TexturePyramid(*image, false, TexturePyramid::Weight::alpha).texels().floats[3], 0.5f);
}

Result<Texels> noise(ByteView, const std::string&) {
  return *random_bytes(64, 64);
}

/// A floor of fine noise to the horizon, under a white sky of radiance 1. A point of reflectance r has radiance r.
std::string floor(const char* filter) {
  return fmt::format(R"({{"camera": {{"eye": [0, 1, 0], "look_at": [0, 0.7, 1], "vertical_fov_degrees": 20}},
      "film": {{"width": 48, "height": 32, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "textures": [{{"name": "t", "file": "t.png", "color_space": "LINEAR", "scale": [8, 8], "filter": "{}"}}],
      "materials": [{{"name": "m", "diffuse": {{"reflectance": {{"texture": "t"}}}}}}],
      "objects": [{{"material": "m", "plane": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}],
      "lights": [{{"name": "sky", "environment": {{"radiance": {{"rgb": [1, 1, 1]}}}}}}]}})",
                     filter);
}

TEST(TextureFootprint, BelowTwoTexelsTheImageIsUnchanged) {
  const Texture plain(random_floats(16, 8), {});
  const Texture texture = with_pyramid(plain);
  const float texel = 1 / 8.0f;  // the wider one
  for (const float u : {-3.3f, 0.0f, 0.21f, 0.999f}) {
    EXPECT_EQ(red_at(texture, u, 0.4f, 1.99f * texel), red_at(plain, u, 0.4f, 0));
    EXPECT_EQ(red_at(texture, u, 0.4f, 0), red_at(plain, u, 0.4f, 0));
    EXPECT_NE(red_at(texture, u, 0.4f, 2.01f * texel), red_at(plain, u, 0.4f, 0));
    EXPECT_EQ(red_at(plain, u, 0.4f, 1), red_at(plain, u, 0.4f, 0)) << "without a pyramid";
  }
}

TEST(TextureFootprint, ChoosesTheLevelWithTexelsOfHalfItsLengthOrMore) {
  const auto image = random_floats(16, 16);
  const Texture texture = with_pyramid(Texture(image, {}));
  for (std::uint32_t level = 1; level <= 4; ++level) {
    const double texels = std::exp2(level), side = 16 / texels;
    for (const double footprint : {texels / 16 * 1.01, texels / 16 * 1.98}) {
      // At the middle of a texel, counted from above and from the left.
      for (const double x : {0.0, side - 1}) {
        const auto u = static_cast<float>((x + 0.5) / side), v = static_cast<float>(1 - 0.5 / side);
        EXPECT_NEAR(red_at(texture, u, v, static_cast<float>(footprint)),
                    mean_of(*image, 0, x * texels, (x + 1) * texels, 0, texels), 1e-6)
            << level;
      }
    }
  }
  const double mean = mean_of(*image, 0, 0, 16, 0, 16);
  for (const float footprint : {1.1f, 100.0f, 1e30f, std::numeric_limits<float>::infinity()}) {
    EXPECT_NEAR(red_at(texture, 0.3f, 7.1f, footprint), mean, 1e-6) << footprint;
  }
}

TEST(TextureFootprint, LanesHaveTheirOwnLevels) {
  const Texture texture = with_pyramid(Texture(random_bytes(64, 32), {}));
  alignas(32) float footprints[8] = {0, 0.03f, 0.06f, 0.12f, 0.25f, 0.5f, 1, 2}, together[8];
  texture.lookup(F8(0.37f), F8(0.71f), F8::load(footprints), M8(true)).rgb.x.store(together);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    EXPECT_EQ(together[lane], red_at(texture, 0.37f, 0.71f, footprints[lane])) << lane;
  }
}

TEST(TextureFootprint, AnImageOfOneTexelHasNoCopies) {
  const Result<Texels> one = Texels{1, 1, std::vector<std::uint32_t>{0xff808080}, {}, false};
  const auto image = [&](ByteView, const std::string&) { return one; };
  const TestScene scene = TestScene::from_text(floor("BILINEAR"), {{"t.png", "t"}}, image);
  EXPECT_FALSE(scene.compiled()->features().footprints);
  const HalfImages rendered = scene.render({"path", 1, 0}, 1);
  EXPECT_NEAR(rendered.mean(3 * (20 * 48 + 24)), 128 / 255.0, 1e-5);
}

// 64 texels along u and 2 along v in the same length: those along v are wider.
TEST(TextureFootprint, FollowsTheWiderTexels) {
  const Texture image = with_pyramid(Texture(random_floats(64, 2), {}));
  const Texture stretched =
      with_pyramid(Texture(random_floats(16, 16), {TextureFilter::bilinear, {}, false, {{{0.125f, 0}, {0, 8}}}}));
  for (const float footprint : {0.5f, 0.9f}) {  // below two of the wider texels
    EXPECT_EQ(red_at(image, 0.3f, 0.3f, footprint), red_at(image, 0.3f, 0.3f, 0));
    EXPECT_EQ(red_at(stretched, 0.3f, 0.3f, footprint), red_at(stretched, 0.3f, 0.3f, 0));
  }
  EXPECT_NE(red_at(image, 0.3f, 0.3f, 1.1f), red_at(image, 0.3f, 0.3f, 0));
  EXPECT_NE(red_at(stretched, 0.3f, 0.3f, 1.1f), red_at(stretched, 0.3f, 0.3f, 0));
}

TEST(TextureFootprint, IsScaledByTheTexturesMatrix) {
  const Texture plain = with_pyramid(Texture(random_floats(32, 32), {}));
  const Texture turned = with_pyramid(
      Texture(random_floats(32, 32), {TextureFilter::bilinear, {}, false, {{{0, 4}, {-4, 0}}}, {0.25f, 0.5f}}));
  for (const float footprint : {0.01f, 0.03f, 0.07f}) {
    EXPECT_FLOAT_EQ(red_at(turned, 0.11f, 0.23f, footprint),
                    red_at(plain, 4 * 0.23f + 0.25f, 0.5f - 4 * 0.11f, 4 * footprint));
  }
}

TEST(TextureFootprint, BeyondAClampedImageItsBorderContinues) {
  const Texture plain(random_floats(16, 16), {TextureFilter::bilinear, {TextureWrap::clamp, TextureWrap::repeat}});
  const Texture texture = with_pyramid(plain);
  for (const float u : {-100.0f, -0.01f, 1.01f, 7.0f}) {
    EXPECT_EQ(red_at(texture, u, 0.3f, 1), red_at(plain, u, 0.3f, 0)) << u;
  }
  EXPECT_NE(red_at(texture, 0.3f, 7.3f, 1), red_at(plain, 0.3f, 7.3f, 0)) << "along v it repeats";
}

TEST(TextureFootprint, NearestLookupsIgnoreIt) {
  const Texture texture = with_pyramid(Texture(random_floats(16, 16), {TextureFilter::nearest}));
  EXPECT_EQ(red_at(texture, 0.3f, 0.3f, 1), red_at(texture, 0.3f, 0.3f, 0));
}

/// Whether the texture of each of these materials averages over footprints.
bool averages(const std::string& material, const std::string& more = "") {
  const TestScene scene = TestScene::from_text(
      fmt::format(R"({{"camera": {{"eye": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 90}},
      "film": {{"width": 1, "height": 1}}, "textures": [{{"name": "t", "file": "t.png"{}}}],
      "materials": [{{"name": "m", {}}}], "objects": [{{"material": "m", "plane": {{"point": [0, 0, 0], "normal": [0, 0, 1]}}}}]}})",
                  more, material),
      {{"t.png", "t"}}, noise);
  EXPECT_EQ(scene.compiled()->features().footprints, scene.compiled()->materials().textures()[0].pyramid() != nullptr);
  return scene.compiled()->features().footprints;
}

TEST(TextureFootprint, OnlyColoursThatAreScatteredAreAveraged) {
  EXPECT_TRUE(averages(R"("diffuse": {"reflectance": {"texture": "t"}})"));
  EXPECT_TRUE(averages(R"("diffuse": {"reflectance": {"rgb": [0.1, 0.1, 0.1]}, "transmittance": {"texture": "t"}})"));
  EXPECT_TRUE(averages(R"("mirror": {"reflectance": {"texture": "t"}})"));
  EXPECT_TRUE(averages(R"("principled": {"base_color": {"texture": "t"}})"));
  EXPECT_TRUE(averages(R"("principled": {"sheen_color": {"texture": "t"}})"));
  EXPECT_TRUE(
      averages(R"("mixture": {"first": {"diffuse": {"reflectance": {"texture": "t"}}}, "second": {"mirror": {}}})"));
  EXPECT_FALSE(averages(R"("diffuse": {"reflectance": {"texture": "t"}})", R"(, "filter": "NEAREST")"));
  EXPECT_FALSE(averages(R"("diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}, "emission": {"texture": "t"})"));
  EXPECT_FALSE(averages(R"("principled": {}, "roughness_map": {"texture": "t"})"));
  EXPECT_FALSE(
      averages(R"("diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}, "opacity": {"map": {"texture": "t"}})"));
  EXPECT_FALSE(averages(R"("diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}, "normal_map": {"texture": "t"})"));
}

/// A square of 2 units with coordinates from 0 to 3, far below the camera, or a plane there.
TestScene far_below(const std::string& object, double tilt = 0) {
  const std::string square =
      "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nvt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\nf 1/1 2/2 3/3 4/4\n";
  return TestScene::from_text(
      fmt::format(
          R"({{"camera": {{"eye": [{}, 10, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "vertical_fov_degrees": 2}},
      "film": {{"width": 40, "height": 20}}, "textures": [{{"name": "t", "file": "t.png"}}],
      "materials": [{{"name": "m", "diffuse": {{"reflectance": {{"texture": "t"}}}}}}], "objects": [{{"material": "m", {}}}]}})",
          tilt, object),
      {{"t.png", "t"}, {"square.obj", square}}, noise);
}

/// The footprint of the ray through the middle of the film.
float footprint_of(const TestScene& scene) {
  const CompiledScene& compiled = *scene.compiled();
  const Ray8 ray = compiled.camera().rays(F8(compiled.camera().center_x), F8(compiled.camera().center_y));
  const Hit8 hits = compiled.accel().intersect(M8(true), ray, true);
  EXPECT_TRUE(hits.hit.any());
  const Surface8 surface = compiled.surface(ray, hits);
  const F8 width = camera_width(compiled, ray.direction, hits.distance);
  alignas(32) float out[8];
  texture_footprint(compiled, hits, surface, ray.direction, width).store(out);
  return out[0];
}

TEST(TextureFootprint, IsHalfAPixelInTextureCoordinates) {
  const double pixel = 10 * 2 * std::tan(std::numbers::pi / 180) / 20;  // one degree to each side
  EXPECT_NEAR(footprint_of(far_below(R"("plane": {"point": [0, 0, 0], "normal": [0, 1, 0]})")), 0.5 * pixel, 1e-6);
  const std::string square = R"("mesh": {"file": "square.obj"})";
  EXPECT_NEAR(footprint_of(far_below(square)), 0.5 * pixel * 3 / 2, 1e-6);
  EXPECT_NEAR(footprint_of(far_below(square + R"(, "transform": {"scale": [0.25, 0.25, 0.25]})")), 0.5 * pixel * 6,
              1e-5);
}

// Instances are kept as meshes of their own scale.
TEST(TextureFootprint, FollowsTheScaleOfInstances) {
  std::string grid, faces;
  for (int i = 0; i <= 40; ++i) {
    grid += fmt::format("v {0} 0 -1\nv {0} 0 1\nvt {1} 0\nvt {1} 3\n", i * 0.05 - 1, i * 0.075);
    const int a = 2 * i + 1;
    faces += i < 40 ? fmt::format("f {0}/{0} {1}/{1} {2}/{2} {3}/{3}\n", a, a + 1, a + 3, a + 2) : "";
  }
  const auto at = [&](double scale) {
    return TestScene::from_text(
        fmt::format(
            R"({{"camera": {{"eye": [0.01, 10, 0.02], "look_at": [0.01, 0, 0.02], "up": [0, 0, 1], "vertical_fov_degrees": 2}},
      "film": {{"width": 40, "height": 20}}, "textures": [{{"name": "t", "file": "t.png"}}],
      "materials": [{{"name": "m", "diffuse": {{"reflectance": {{"texture": "t"}}}}}}],
      "objects": [{{"material": "m", "mesh": {{"file": "g.obj"}}, "transform": {{"scale": [{0}, {0}, {0}]}}}},
                  {{"material": "m", "mesh": {{"file": "g.obj"}}, "transform": {{"translate": [90, 0, 0]}}}}]}})",
            scale),
        {{"t.png", "t"}, {"g.obj", grid + faces}}, noise);
  };
  const double pixel = 10 * 2 * std::tan(std::numbers::pi / 180) / 20;
  EXPECT_NEAR(footprint_of(at(1)), 0.5 * pixel * 1.5, 1e-5);
  EXPECT_NEAR(footprint_of(at(8)), 0.5 * pixel * 1.5 / 8, 1e-6);
}

TEST(TextureFootprint, AtGrazingAnglesAnEighthOfTheLengthCountsUpToTwice) {
  const std::string plane = R"("plane": {"point": [0, 0, 0], "normal": [0, 1, 0]})";
  for (const double tilt : {20.0, 120.0, 200.0}) {  // the eye is 10 above the plane
    const double distance = std::hypot(tilt, 10), cosine = 10 / distance;
    const double pixel = distance * 2 * std::tan(std::numbers::pi / 180) / 20;
    const double longer = std::clamp(1 / (8 * cosine), 1.0, 2.0);
    EXPECT_NEAR(footprint_of(far_below(plane, tilt)) / (0.5 * pixel * longer), 1, 1e-4);
  }
}

struct Spread {
  double mean = 0, standard_error = 0, variance = 0;  ///< of pixels
};
Spread spread(const char* method, const char* filter) {
  const HalfImages image = TestScene::from_text(floor(filter), {{"t.png", "t"}}, noise).render({method, 1, 0}, 2);
  Spread out;
  std::size_t pixels = 0;
  for (std::size_t i = 0; i < image.a.size(); i += 3) {
    if (i / 3 / 48 >= 8) {  // below the horizon
      out.mean += image.mean(i);
      out.variance += image.variance(i);
      ++pixels;
    }
  }
  out.mean /= static_cast<double>(pixels);
  out.variance /= static_cast<double>(pixels);
  out.standard_error = std::sqrt(out.variance / static_cast<double>(pixels));
  return out;
}

TEST(TextureFootprint, FineTexturesBringLittleNoiseAndKeepTheirMean) {
  double mean = 0;
  const auto image = random_bytes(64, 64);
  for (const std::uint32_t texel : image->bytes) {
    mean += (texel & 255) / 255.0 / (64 * 64);
  }
  for (const char* method : {"path", "caustic", "preview"}) {
    const Spread averaged = spread(method, "BILINEAR"), plain = spread(method, "NEAREST");
    EXPECT_NEAR(plain.mean, mean, 4 * plain.standard_error) << method;
    EXPECT_NEAR(averaged.mean, mean, 4 * averaged.standard_error + 0.002) << method << ": bytes are rounded";
    EXPECT_LT(20 * averaged.variance, plain.variance) << method;
  }
  // Light vertices see the texture as it is, and so do camera paths. Bilinear lookups alone average four texels.
  EXPECT_GT(8 * spread("vcm", "BILINEAR").variance, spread("vcm", "NEAREST").variance);
}

/// A wall that is lit only by a striped floor in the sun.
std::string wall(const char* filter, const char* fog) {
  return fmt::format(R"({{"camera": {{"eye": [0, 1, 3], "look_at": [0, 1, 0], "vertical_fov_degrees": 30}},
      "film": {{"width": 16, "height": 16}},
      "textures": [{{"name": "t", "file": "t.png", "color_space": "LINEAR", "filter": "{}", "scale": [0.125, 2]}}],
      "materials": [{{"name": "floor", "diffuse": {{"reflectance": {{"texture": "t"}}}}}},
                    {{"name": "wall", "diffuse": {{"reflectance": {{"rgb": [0.8, 0.8, 0.8]}}}}}},
                    {{"name": "fog", "dielectric": {{"ior": 1}}, "interior": {{"scattering": {{"rgb": [1e-3, 1e-3, 1e-3]}}}}}}],
      "objects": [{{"material": "floor", "plane": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}},
                  {{"material": "wall", "plane": {{"point": [0, 0, 0], "normal": [0, 0, 1]}}}}{}],
      "lights": [{{"name": "sun", "directional": {{"direction": [0, -1, -0.001], "irradiance": {{"rgb": [3, 3, 3]}}}}}}]}})",
                     filter, fog);
}

/// Mean of the picture, and its standard error.
Estimate mean_of(const std::string& document, std::uint32_t level) {
  const HalfImages image = TestScene::from_text(document, {{"t.png", "t"}}, noise).render({"path", 1, 0}, level);
  Estimate out;
  double variance = 0;
  const double count = static_cast<double>(image.a.size());
  for (std::size_t i = 0; i < image.a.size(); ++i) {
    out.value += image.mean(i) / count;
    variance += image.variance(i);
  }
  // The channels of a pixel are not independent.
  out.standard_error = std::sqrt(3 * variance) / count;
  return out;
}

TEST(TextureFootprint, IndirectLightKeepsItsMean) {
  const Estimate plain = mean_of(wall("NEAREST", ""), 10), averaged = mean_of(wall("BILINEAR", ""), 10);
  EXPECT_NEAR(averaged.value / plain.value, 1,
              0.001 + 4 * std::hypot(plain.standard_error, averaged.standard_error) / plain.value);
}

TEST(TextureFootprint, TexturesThroughThinFogKeepTheirColour) {
  const char* const fog = R"(, {"material": "fog", "sphere": {"center": [0, 1, 0], "radius": 20}})";
  const Estimate plain = mean_of(wall("NEAREST", fog), 9), averaged = mean_of(wall("BILINEAR", fog), 9);
  EXPECT_NEAR(averaged.value / plain.value, 1,
              0.001 + 4 * std::hypot(plain.standard_error, averaged.standard_error) / plain.value);
}

}  // namespace
}  // namespace lightmill::test
