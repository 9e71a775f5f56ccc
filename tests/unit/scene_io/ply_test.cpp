// PLY files: every format gives the same mesh, and damage is an error with its place.
#include "common/scene_io/ply.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "tests/fuzz/fuzz_loop.h"
#include "tests/support/error_message.h"

namespace lightmill {
namespace {

constexpr std::string_view kProperties =
    "comment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
    "property float ny\nproperty float nz\nproperty uchar red\nproperty float u\nproperty float v\nelement face 2\n"
    "property list uchar int vertex_indices\nproperty int group\nend_header\n";

std::string ascii() {
  return "ply\nformat ascii 1.0\n" + std::string(kProperties) +
         "0 0 0 0 0 2 255 0 0\n1 0 0 0 0 2 0 1 0\n1 1 0 0 0 2 0 1 1\n0 1 0 0 0 2 0 0 1\n4 0 1 2 3 7\n3 0 2 3 8\n";
}

template <class T>
void put(std::string& out, T value, bool big) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big) {
    std::ranges::reverse(bytes);
  }
  out.append(bytes.data(), bytes.size());
}

std::string binary(bool big) {
  std::string out = std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") + " 1.0\n" +
                    std::string(kProperties);
  for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
    for (const int value : {x, y, 0, 0, 0, 2}) {
      put(out, static_cast<float>(value), big);
    }
    put(out, std::uint8_t{9}, big);
    put(out, static_cast<float>(x), big);
    put(out, static_cast<float>(y), big);
  }
  for (const auto& face : {std::vector<int>{0, 1, 2, 3}, {0, 2, 3}}) {
    put(out, static_cast<std::uint8_t>(face.size()), big);
    for (const int corner : face) {
      put(out, corner, big);
    }
    put(out, 7, big);
  }
  return out;
}

std::string error_of(const std::string& bytes) {
  return test::error_message(read_ply(bytes, "a.ply"));
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Ply, AllFormatsGiveTheSameMesh) {
  const Result<Mesh> mesh = read_ply(ascii(), "a.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->positions, (std::vector<std::array<double, 3>>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh->normals, (std::vector<std::array<float, 3>>(4, {0, 0, 1})));
  EXPECT_EQ(mesh->texture_coordinates, (std::vector<std::array<float, 2>>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_EQ(mesh->triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 2, 3}}));
  for (const bool big : {false, true}) {
    const Result<Mesh> other = read_ply(binary(big), "b.ply");
    ASSERT_TRUE(other.ok()) << other.status();
    EXPECT_EQ(encode_mesh(*other), encode_mesh(*mesh)) << big;
  }
}

TEST(Ply, VerticesMayHaveColours) {
  const auto colors = [](const std::string& type, const std::string& colors_of_one, std::vector<std::string>& notices) {
    const Result<Mesh> mesh =
        read_ply(fmt::format("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                             "property float z\nproperty {0} red\nproperty {0} green\nproperty {0} blue\n"
                             "property {0} alpha\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
                             "0 0 0 {1}\n1 0 0 {1}\n0 1 0 {1}\n3 0 1 2\n",
                             type, colors_of_one),
                 "a.ply", &notices);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.value_or(Mesh{}).colors;
  };
  const std::string left_out = "left out: alpha of vertex colours of a.ply";
  for (const auto& [type, written] : {std::pair{"uchar", "255 0 51 255"},
                                      {"ushort", "65535 0 13107 65535"},
                                      {"float", "1 0 0.2 1"},
                                      {"double", "255 -3 51 255"},
                                      {"int", "255 0 51 255"}}) {
    std::vector<std::string> notices;
    const auto read = colors(type, written, notices);
    ASSERT_EQ(read.size(), 3u);
    EXPECT_EQ(read[2][0], 1) << type;
    EXPECT_EQ(read[2][1], 0) << type;
    EXPECT_NEAR(read[2][2], std::pow((0.2 + 0.055) / 1.055, 2.4), 1e-5) << "the sRGB curve";
    EXPECT_EQ(read[2][3], 1) << type;
    EXPECT_TRUE(notices.empty());
  }
  std::vector<std::string> notices;
  EXPECT_EQ(colors("uchar", "255 255 255 100", notices)[0], (std::array<float, 4>{1, 1, 1, 1}));
  EXPECT_EQ(notices, std::vector{left_out});
  EXPECT_TRUE(read_ply(ascii(), "a.ply")->colors.empty()) << "no colours are wanted";
}

TEST(Ply, UnknownLinesOfTheHeaderAreSkipped) {
  std::vector<std::string> notices;
  EXPECT_TRUE(read_ply(replaced(ascii(), "comment made", "made"), "a.ply", &notices).ok());
  EXPECT_EQ(notices, std::vector<std::string>{"left out: a.ply: line 3: unknown keyword \"made\""});
  EXPECT_TRUE(read_ply(replaced(ascii(), "comment made", "made"), "a.ply").ok());
  std::string many = "ply\n";
  for (int i = 0; i < 20'000; ++i) {
    many += "x\n";
  }
  EXPECT_EQ(error_of(many), "a.ply: the header has more than 10000 lines");
}

TEST(Ply, ErrorsNameTheirPlace) {
  EXPECT_EQ(error_of("solid x"), "a.ply: a PLY file begins with the line \"ply\"");
  EXPECT_EQ(error_of("ply\nformat ascii 1.0\n"), "a.ply: the header has no end_header");
  EXPECT_EQ(error_of(replaced(ascii(), "ascii", "zip")), "a.ply: line 2: unknown format \"zip\"");
  EXPECT_EQ(error_of(replaced(ascii(), "float x", "real x")), "a.ply: line 5: unknown type \"real\"");
  EXPECT_EQ(error_of(replaced(ascii(), "float x", "float a")), "a.ply: vertices have no x, y and z");
  EXPECT_EQ(error_of(replaced(ascii(), "3 0 2 3 8", "3 0 2 4 8")), "a.ply: face[1]: there is no vertex 4, there are 4");
  EXPECT_EQ(error_of(replaced(ascii(), "face 2", "face 3")), "a.ply: face[2]: the file ends, or has no number there");
  EXPECT_EQ(error_of(replaced(ascii(), "vertex 4", "vertex 99999999999")),
            "a.ply: vertex[5]: the file ends, or has no number there")
      << "it must not allocate memory for missing data";
  EXPECT_EQ(error_of(replaced(ascii(), "1 1 0 0 0 2", "1e300 1 0 0 0 2")),
            "a.ply: vertex[2]: coordinates must be finite and at most 1e30");
}

TEST(Ply, DamagedFilesAreReadOrRefused) {
  constexpr std::array<std::string_view, 8> kWords{
      "4294967295", "-1", "\n", "list ", "nan", "\xff\xff\xff\xff", "property uchar a\n", "1e39"};
  expect_both_outcomes({ascii(), binary(false), binary(true)}, 31, fuzz_cases(3000),
                       [&](const std::string& original, FuzzRandom& random) {
                         const Result<Mesh> mesh = read_ply(mutate(original, kWords, random), "a.ply");
                         EXPECT_TRUE(!mesh.ok() || validate(*mesh).ok());
                         EXPECT_TRUE(mesh.ok() || message_of(mesh.status()).starts_with("a.ply: ")) << mesh.status();
                         return mesh.ok();
                       });
}

}  // namespace
}  // namespace lightmill
