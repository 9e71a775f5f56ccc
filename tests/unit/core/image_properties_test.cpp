// Properties of pixels in the headers of image files: one row for each property, with its effect.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "common/image/exr.h"
#include "tests/support/image_files.h"
#include "tests/support/read_image.h"

namespace lightmill::test {
namespace {

using Rgb = std::array<float, 3>;
using Rows = std::vector<std::vector<Rgb>>;  ///< from the top

constexpr Rgb kColor{0.5f, 0.25f, 0.125f}, kBlack{0, 0, 0};

/// Pixel (x, y) of the numbered picture. Each value is exact in Radiance's format.
Rgb color_at(int x, int y) {
  return {static_cast<float>(1 + x + 16 * y), static_cast<float>(64 + x), static_cast<float>(80 + y)};
}

Rows numbered_rows(int width, int height) {
  Rows rows;
  for (int y = 0; y < height; ++y) {
    rows.emplace_back();
    for (int x = 0; x < width; ++x) {
      rows.back().push_back(color_at(x, y));
    }
  }
  return rows;
}

std::string exr_file(const ImageWindow& display, const ImageWindow& data, const std::function<Rgb(int, int)>& color) {
  Image image{display, data, {}, {}};
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (int y = 0; y < data.height; ++y) {
      for (int x = 0; x < data.width; ++x) {
        values.push_back(color(x + data.x, y + data.y)[c]);
      }
    }
    image.channels.push_back({std::string(1, "RGB"[c]), std::move(values)});
  }
  return *encode_exr(image);
}

/// One pixel of kColor, with these chromaticities of red, green, blue and white.
std::string exr_with(const std::array<float, 8>& chromaticities) {
  std::string file = exr_file({0, 0, 1, 1}, {0, 0, 1, 1}, [](int, int) { return kColor; });
  const std::string name("chromaticities\0chromaticities\0", 30);
  const std::size_t at = file.find(name);
  EXPECT_NE(at, std::string::npos);
  std::memcpy(file.data() + at + name.size() + 4, chromaticities.data(), sizeof(chromaticities));
  return file;
}

/// One pixel of kColor with the attribute that says that the image is a map of all directions: 0 by latitudes, 1 a cube.
std::string exr_envmap(char kind) {
  std::string file = exr_file({0, 0, 1, 6}, {0, 0, 1, 6}, [](int, int) { return kColor; });
  const std::string attribute = std::string("envmap\0envmap\0\1\0\0\0", 18) + kind;
  const std::size_t end = file.find(std::string("lineOrder\0", 10));
  file.insert(end, attribute);
  // The table of offsets begins after the header. Each of its 64-bit entries moves with the header.
  const std::size_t table = *exr_header_end(as_byte_view(file));
  std::uint64_t offset = 0;
  std::memcpy(&offset, file.data() + table, sizeof(offset));
  offset += attribute.size();
  std::memcpy(file.data() + table, &offset, sizeof(offset));
  return file;
}

/// A value is its mantissa times 2^(exponent − 136).
std::string rgbe(const Rgb& color) {
  int exponent = 0;
  std::frexp(*std::ranges::max_element(color), &exponent);
  std::string out;
  for (const float value : color) {
    out += static_cast<char>(static_cast<int>(std::ldexp(value, 8 - exponent)));
  }
  return out + static_cast<char>(exponent + 128);
}

/// A Radiance picture of the numbered rows, in the order that the line of its size states.
std::string radiance(const Rows& rows, const std::string& variables = "", const std::string& axes = "-Y+X") {
  const int width = static_cast<int>(rows.front().size()), height = static_cast<int>(rows.size());
  std::string out = "#?RADIANCE\n" + variables;
  out += variables.find("FORMAT") == std::string::npos ? "FORMAT=32-bit_rle_rgbe\n\n" : "\n";
  const auto order = [&](std::size_t axis) {
    std::vector<int> places;
    for (int i = 0; i < (axes[axis + 1] == 'X' ? width : height); ++i) {
      places.push_back(i);
    }
    if (axes.substr(axis, 2) == "-X" || axes.substr(axis, 2) == "+Y") {
      std::ranges::reverse(places);  // x points to the right, and y up
    }
    return places;
  };
  out += fmt::format("{} {} {} {}\n", axes.substr(0, 2), order(0).size(), axes.substr(2), order(2).size());
  for (const int first : order(0)) {
    for (const int second : order(2)) {
      const bool columns = axes[1] == 'X';
      out += rgbe(
          rows[static_cast<std::size_t>(columns ? second : first)][static_cast<std::size_t>(columns ? first : second)]);
    }
  }
  return out;
}

Rows times(Rows rows, const Rgb& factor) {
  for (auto& row : rows) {
    for (Rgb& color : row) {
      for (std::size_t c = 0; c < 3; ++c) {
        color[c] *= factor[c];
      }
    }
  }
  return rows;
}

/// A published matrix, row by row, times kColor.
Rows by_matrix(const std::array<double, 9>& m) {
  Rgb out{};
  for (std::size_t row = 0; row < 3; ++row) {
    out[row] = static_cast<float>(m[3 * row] * kColor[0] + m[3 * row + 1] * kColor[1] + m[3 * row + 2] * kColor[2]);
  }
  return {{out}};
}

struct Property {
  std::string name;
  std::string file;
  Rows expected;      ///< linear Rec. 709
  std::string error;  ///< instead: the beginning of the message
};

std::vector<Property> properties() {
  constexpr std::array<double, 9> kSrgbOfXyz{3.2406, -1.5372, -0.4986, -0.9689, 1.8758,
                                             0.0415, 0.0557,  -0.2040, 1.0570};  // IEC 61966-2-1
  constexpr std::array<double, 9> kOf2020{1.6605,  -0.5876, -0.0728, -0.1246, 1.1329,
                                          -0.0083, -0.0182, -0.1006, 1.1187};  // ITU-R BT.2087
  constexpr std::array<double, 9> kOfAcescg{
      1.70505,  -0.62179, -0.08326, -0.13026, 1.14080,
      -0.01055, -0.02400, -0.12897, 1.15297};  // ACES: AP1, D60 to D65 by Bradford
  const Rows one{{kColor}}, three = numbered_rows(3, 2);
  const ImageWindow frame{10, 20, 4, 3};
  std::vector<Property> rows{
      {"EXR chromaticities: Rec. 709", exr_with({.64f, .33f, .30f, .60f, .15f, .06f, .3127f, .3290f}), one, ""},
      {"EXR chromaticities: CIE XYZ", exr_with({1, 0, 0, 1, 0, 0, 1 / 3.0f, 1 / 3.0f}), by_matrix(kSrgbOfXyz), ""},
      {"EXR chromaticities: Rec. 2020", exr_with({.708f, .292f, .170f, .797f, .131f, .046f, .3127f, .3290f}),
       by_matrix(kOf2020), ""},
      {"EXR chromaticities: ACEScg", exr_with({.713f, .293f, .165f, .830f, .128f, .044f, .32168f, .33767f}),
       by_matrix(kOfAcescg), ""},
      {"EXR chromaticities: none",
       exr_with({.3f, .3f, .3f, .3f, .3f, .3f, .3f, .3f}),
       {},
       "red (0.3, 0.3), green (0.3, 0.3), blue (0.3, 0.3) and white (0.3, 0.3) are not the chromaticities of a colour"},
      {"EXR chromaticities: a white without light",
       exr_with({.64f, .33f, .30f, .60f, .15f, .06f, .3f, 0}),
       {},
       "red (0.64, 0.33), "},
      {"EXR window: a part of the frame",
       exr_file(frame, {12, 21, 2, 1}, color_at),
       {{kBlack, kBlack, kBlack, kBlack},
        {kBlack, kBlack, color_at(12, 21), color_at(13, 21)},
        {kBlack, kBlack, kBlack, kBlack}},
       ""},
      {"EXR window: more than the frame",
       exr_file({1, 1, 2, 1}, {0, 0, 5, 4}, color_at),
       {{color_at(1, 1), color_at(2, 1)}},
       ""},
      {"EXR window: across the frame's edge",
       exr_file({0, 0, 2, 2}, {-1, 1, 2, 2}, color_at),
       {{kBlack, kBlack}, {color_at(0, 1), kBlack}},
       ""},
      {"EXR window: outside of the frame", exr_file({0, 0, 1, 1}, {5, 5, 1, 1}, color_at), {{kBlack}}, ""},
      {"EXR envmap: latitudes", exr_envmap(0), Rows(6, {kColor}), ""},
      {"EXR envmap: cube", exr_envmap(1), {}, "a cube map cannot be read"},
      {"Radiance EXPOSURE", radiance(three, "EXPOSURE=4\nSOFTWARE=a program\nEXPOSURE= 0.5\n"),
       times(three, {.5f, .5f, .5f}), ""},
      {"Radiance COLORCORR", radiance(three, "COLORCORR= 0.5 1 2\nEXPOSURE=2\n"), times(three, {1, .5f, .25f}), ""},
      {"Radiance EXPOSURE of an earlier picture", radiance(three, "\tEXPOSURE=4\n"), three, ""},
      {"Radiance XYZE", radiance(one, "FORMAT=32-bit_rle_xyze\n"), by_matrix(kSrgbOfXyz), ""},
      {"Radiance PRIMARIES", radiance(one, "PRIMARIES= .708 .292 .170 .797 .131 .046 .3127 .3290\n"),
       by_matrix(kOf2020), ""},
      {"Radiance GAMMA 1", radiance(one, "GAMMA=1.0\n"), one, ""},
      {"Radiance GAMMA",
       radiance(one, "GAMMA=2.2\n"),
       {},
       "not a readable Radiance picture: a picture with linear values (GAMMA=1) is expected, got \"GAMMA=2.2\""},
      {"Radiance EXPOSURE 0",
       radiance(one, "EXPOSURE=0\n"),
       {},
       "not a readable Radiance picture: a factor above 0 is expected, got \"EXPOSURE=0\""},
      {"Radiance FORMAT",
       radiance(one, "FORMAT=ascii\n"),
       {},
       "not a readable Radiance picture: FORMAT=32-bit_rle_rgbe or 32-bit_rle_xyze is expected, got \"FORMAT=ascii\""},
      {"Radiance size",
       "#?RADIANCE\n\n-Y 2 -Y 2\n",
       {},
       "not a readable Radiance picture: a size such as -Y 512 +X 1024 is expected, got \"-Y 2 -Y 2\""},
      {"Radiance size: none", "#?RADIANCE\n\n", {}, "not a readable Radiance picture: its header has no end"},
  };
  for (const char* axes : {"-Y+X", "-Y-X", "+Y+X", "+Y-X", "+X-Y", "+X+Y", "-X-Y", "-X+Y"}) {
    rows.push_back({fmt::format("Radiance orientation {}", axes), radiance(three, "", axes), three, ""});
    rows.push_back({fmt::format("Radiance orientation {}, a column", axes), radiance(numbered_rows(1, 9), "", axes),
                    numbered_rows(1, 9), ""});
  }
  return rows;
}

TEST(ImageProperties, AreAppliedOrRefusedByName) {
  for (const Property& property : properties()) {
    SCOPED_TRACE(property.name);
    const Result<Texels> texels = read_image(as_byte_view(property.file), "a");
    if (!property.error.empty()) {
      EXPECT_TRUE(message_of(texels.status()).starts_with("a: " + property.error)) << texels.status();
      continue;
    }
    ASSERT_TRUE(texels.ok()) << texels.status();
    ASSERT_EQ(texels->height, static_cast<int>(property.expected.size()));
    ASSERT_EQ(texels->width, static_cast<int>(property.expected.front().size()));
    const std::vector<float> values = values_of(*texels);
    ASSERT_EQ(values.size(), 4u * property.expected.size() * property.expected.front().size());
    const bool radiance = property.name.starts_with("Radiance");
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i % 4 == 3) {
        continue;
      }
      const std::size_t pixel = i / 4, width = property.expected.front().size();
      const float expected = property.expected[pixel / width][pixel % width][i % 4];
      // Published matrices have four digits. Radiance's decoders may add half a step of the mantissa.
      const float most = *std::ranges::max_element(property.expected[pixel / width][pixel % width]);
      EXPECT_NEAR(values[i], expected, 2e-4f + (radiance ? most / 128 : 0)) << pixel << " " << i % 4;
    }
  }
}

std::string big_endian(std::uint64_t value, int bytes) {
  std::string out;
  for (int i = bytes - 1; i >= 0; --i) {
    out += static_cast<char>(value >> (8 * i) & 0xff);
  }
  return out;
}

/// The CRC of PNG's chunks (ISO 15948, annex D).
std::uint32_t crc(std::string_view bytes) {
  std::uint32_t sum = ~0u;
  for (const char byte : bytes) {
    sum ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      sum = (sum & 1) != 0 ? sum >> 1 ^ 0xedb88320u : sum >> 1;
    }
  }
  return ~sum;
}

/// A PNG whose gAMA chunk, the only statement of its colours, states the exponent of the encoder.
std::string png_with_gamma(double exponent) {
  std::string file = image_file("png", 0.5f);
  for (const char* const kind : {"gAMA", "sRGB", "iCCP", "cHRM"}) {
    if (const std::size_t at = file.find(kind); at != std::string::npos) {
      file.erase(at - 4, 12 + static_cast<unsigned char>(file[at - 1]));
    }
  }
  const std::string chunk = "gAMA" + big_endian(static_cast<std::uint64_t>(std::lround(exponent * 1e5)), 4);
  constexpr std::size_t kEndOfHeader = 8 + 25;
  return file.insert(kEndOfHeader, big_endian(4, 4) + chunk + big_endian(crc(chunk), 4));
}

/// A JPEG with a segment after its first marker.
std::string jpeg_with(char marker, const std::string& content) {
  return image_file("jpg", 0.5f).insert(2, std::string("\xff") + marker + big_endian(content.size() + 2, 2) + content);
}

std::string jpeg_with_orientation(int orientation) {
  const std::string entry = big_endian(0x112, 2) + big_endian(3, 2) + big_endian(1, 4) +
                            big_endian(static_cast<std::uint64_t>(orientation), 2) + std::string(2, '\0');
  return jpeg_with('\xe1', std::string("Exif\0\0MM\0*\0\0\0\x08\0\1", 16) + entry + std::string(4, '\0'));
}

/// A profile with a name only (ICC.1:2001, 6.1 and 6.5.17).
std::string jpeg_with_profile(const std::string& name) {
  const std::string text =
      std::string("desc\0\0\0\0", 8) + big_endian(name.size() + 1, 4) + name + std::string(79, '\0');
  std::string profile = std::string(36, '\0') + "acsp" + std::string(88, '\0') + big_endian(1, 4) + "desc" +
                        big_endian(144, 4) + big_endian(text.size(), 4) + text;
  profile.replace(0, 4, big_endian(profile.size(), 4));
  return jpeg_with('\xe2', std::string("ICC_PROFILE\0\1\1", 14) + profile);
}

TEST(ImageProperties, IgnoredOnesAreFound) {
  const struct {
    std::string name, file;
    IgnoredProperties ignored;
  } rows[] = {{"PNG without", image_file("png", 0.5f), {}},
              {"PNG gAMA of sRGB", png_with_gamma(1 / 2.2), {}},
              {"PNG gAMA 1", png_with_gamma(1), {false, true, false}},
              {"PNG gAMA 1/1.8", png_with_gamma(1 / 1.8), {false, true, false}},
              {"JPEG without", image_file("jpg", 0.5f), {}},
              {"JPEG upright", jpeg_with_orientation(1), {}},
              {"JPEG turned", jpeg_with_orientation(6), {true, false, false}},
              {"JPEG with sRGB's profile", jpeg_with_profile("sRGB IEC61966-2.1"), {}},
              {"JPEG with a profile", jpeg_with_profile("Display P3"), {false, false, true}},
              {"EXR without", image_file("exr", 0.5f), {}},
              {"Radiance turned", radiance(numbered_rows(3, 2), "", "+X+Y"), {}}};
  for (const auto& [name, file, ignored] : rows) {
    const Result<ImageSize> size = read_size(as_byte_view(file), "a");
    ASSERT_TRUE(size.ok()) << name << size.status();
    EXPECT_EQ(size->ignored.orientation, ignored.orientation) << name;
    EXPECT_EQ(size->ignored.gamma, ignored.gamma) << name;
    EXPECT_EQ(size->ignored.profile, ignored.profile) << name;
  }
}

// Alpha outside of the data window is 0, as OpenEXR defines. Inside it is 1, because the file has no alpha.
TEST(ImageProperties, PixelsOutsideOfTheDataWindowAreTransparent) {
  const std::string file = exr_file({0, 0, 3, 1}, {1, 0, 1, 1}, color_at);
  const Result<Texels> texels = read_image(as_byte_view(file), "a.exr");
  ASSERT_TRUE(texels.ok()) << texels.status();
  EXPECT_EQ(values_of(*texels)[3], 0);
  EXPECT_EQ(values_of(*texels)[7], 1);
  EXPECT_EQ(values_of(*texels)[11], 0);
}

// A display window of few pixels does not let a file have many.
TEST(ImageProperties, BothWindowsAreLimited) {
  const auto black = [](int, int) { return kBlack; };
  for (const auto& [display, data] :
       {std::pair<ImageWindow, ImageWindow>{{0, 0, 1, 1}, {0, 0, 9, 1}}, {{0, 0, 9, 1}, {0, 0, 1, 1}}}) {
    const std::string file = exr_file(display, data, black);
    EXPECT_TRUE(
        message_of(read_image_within(as_byte_view(file), "a.exr", 8).status()).starts_with("a.exr: 9x1 pixels"));
    EXPECT_TRUE(read_image_within(as_byte_view(file), "a.exr", 9).ok());
  }
}

}  // namespace
}  // namespace lightmill::test
