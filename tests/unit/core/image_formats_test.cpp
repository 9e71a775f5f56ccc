// Image formats beside PNG and EXR: files built from the formats' definitions, then decoded and rendered.
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene_io/gltf/gltf.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"
#include "tests/unit/scene_io/gltf_text.h"

namespace lightmill::test {
namespace {

std::string bytes(std::initializer_list<int> values) {
  std::string out;
  for (const int value : values) {
    out += static_cast<char>(value);
  }
  return out;
}

/// Radiance's RGBE, 8×2 pixels: (1, .5, .25) on the left half, (200, 100, 50) on the right one. A value is its mantissa
/// times 2^(exponent − 136). The first row has runs (128 + length, value) and literals (length, values). The second row
/// has plain pixels.
std::string sky_hdr() {
  std::string out = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n";
  out += bytes({2, 2, 0, 8});
  out += bytes({128 + 4, 128, 128 + 4, 200});
  out += bytes({8, 64, 64, 64, 64, 100, 100, 100, 100});
  out += bytes({128 + 4, 32, 4, 50, 50, 50, 50});
  out += bytes({4, 129, 129, 129, 129, 128 + 4, 136});
  for (int x = 0; x < 8; ++x) {
    out += x < 4 ? bytes({128, 64, 32, 129}) : bytes({200, 100, 50, 136});
  }
  return out;
}
constexpr std::array<float, 3> kLeft{1, 0.5f, 0.25f}, kRight{200, 100, 50};
// Decoders can add half a step of the mantissa, as Ward's decoder does.
constexpr float kLeftStep = 1.0f / 256, kRightStep = 0.5f;

TEST(ImageFormats, RadianceFilesAreLinear) {
  const std::string file = sky_hdr();
  const Result<Texels> texels = read_image(as_byte_view(file), "sky.hdr");
  ASSERT_TRUE(texels.ok()) << texels.status();
  ASSERT_EQ(texels->width, 8);
  ASSERT_EQ(texels->height, 2);
  EXPECT_FALSE(texels->encoded);
  ASSERT_EQ(texels->floats.size(), 64u);
  for (std::size_t pixel = 0; pixel < 16; ++pixel) {
    const bool left = pixel % 8 < 4;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(texels->floats[4 * pixel + c], (left ? kLeft : kRight)[c], left ? kLeftStep : kRightStep) << pixel;
    }
  }
}

TEST(ImageFormats, ARadianceFileIsASky) {
  // The picture's centre is at +x, its right half towards +z.
  const auto seen = [](int z, std::size_t channel) {
    const std::string text = fmt::format(
        R"({{"camera": {{"eye": [0, 0, 0], "look_at": [0, 0, {}], "vertical_fov_degrees": 1}},
          "film": {{"width": 8, "height": 8}}, "lights": [{{"name": "sky", "environment": {{"file": "sky.hdr"}}}}],
          "materials": [{{"name": "m", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}}}}],
          "objects": [{{"material": "m", "sphere": {{"center": [100, 0, 0], "radius": 1}}}}]}})",
        z);
    return TestScene::from_text(text, {{"sky.hdr", sky_hdr()}}, read_image)
        .render({"path", 1, 0}, 1)
        .mean(3 * 36 + channel);
  };
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(seen(-1, c), kLeft[c], kLeftStep) << c;
    EXPECT_NEAR(seen(1, c), kRight[c], kRightStep) << c;
  }
}

/// A baseline JPEG of 16×8 pixels: two blocks of one colour each. (Y, Cb, Cr) = (76, 85, 255) is red, and (29, 255,
/// 107) is blue. All quantisers are 8, so a block's only coefficient is its value − 128. The stream holds the
/// differences from block to block. The codes 00, 01 and 10 mean 6, 7 and 8 bits, and 0 ends a block.
std::string red_and_blue_jpeg() {
  std::string out = bytes({0xff, 0xd8, 0xff, 0xdb, 0, 67, 0}) + std::string(64, '\x08');
  out += bytes({0xff, 0xc0, 0, 17, 8, 0, 8, 0, 16, 3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0});
  out += bytes({0xff, 0xc4, 0, 22, 0x00, 0, 3}) + std::string(14, '\0') + bytes({6, 7, 8});
  out += bytes({0xff, 0xc4, 0, 20, 0x10, 1}) + std::string(15, '\0') + bytes({0});
  out += bytes({0xff, 0xda, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, 63, 0});
  std::string bits = "00 001011 0  00 010100 0  01 1111111 0 ";  // −52, −43, 127
  bits += "00 010000 0  10 10101010 0  10 01101011 0  11111";    // −47, 170, −148
  std::erase(bits, ' ');
  for (std::size_t i = 0; i < bits.size(); i += 8) {
    out += static_cast<char>(std::stoi(bits.substr(i, 8), nullptr, 2));
  }
  return out + bytes({0xff, 0xd9});
}

TEST(ImageFormats, AJpegInAGltfFileIsATexture) {
  GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  buffer.add(packed<float>({0, 0, 1, 0, 0, 1}), "VEC2", 5126, 3);
  const std::string text = gltf(
      buffer.embedded() + R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
"nodes":[{"mesh":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],
"images":[{"uri":"data:image/jpeg;base64,)" +
      base64(red_and_blue_jpeg()) + R"("}])");
  const Result<LoadedScene> loaded =
      read_gltf(text, "a.gltf", {}, [](const std::string& name) { return Result<SourceFile>(not_found("{}", name)); });
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->scene.textures.size(), 1u);
  const TextureImage& image = loaded->scene.textures[0];
  EXPECT_TRUE(image.file.ends_with(".jpg")) << image.file;
  const Result<Texels> texels = read_image(as_byte_view(loaded->assets.at(image.asset)), image.file);
  ASSERT_TRUE(texels.ok()) << texels.status();
  ASSERT_EQ(texels->width, 16);
  ASSERT_EQ(texels->height, 8);
  EXPECT_TRUE(texels->encoded);
  ASSERT_EQ(texels->bytes.size(), 128u);
  for (std::size_t pixel = 0; pixel < 128; ++pixel) {
    // R = Y + 1.402 (Cr − 128), G = Y − .344 (Cb − 128) − .714 (Cr − 128), B = Y + 1.772 (Cb − 128); decoders round.
    const bool left = pixel % 16 < 8;
    const std::array<int, 3> expected{left ? 254 : 0, 0, left ? 0 : 254};
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(static_cast<int>(texels->bytes[pixel] >> (8 * c) & 255), expected[c], 2) << pixel << " " << c;
    }
    EXPECT_EQ(texels->bytes[pixel] >> 24, 255u);
  }
}

}  // namespace
}  // namespace lightmill::test
