// STL files: both formats give the same mesh, and damage is an error with its place.
#include "common/scene_io/stl.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/fuzz/fuzz_loop.h"
#include "tests/support/error_message.h"

namespace lightmill {
namespace {

using Triangle = std::array<std::array<float, 3>, 3>;

/// Two triangles of a square, which share an edge.
const std::vector<Triangle> kSquare{{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}, {{{0, 0, 0}, {1, 1, 0}, {0, 1, 0}}}};

std::string ascii_stl() {
  std::string out = "solid square\n";
  for (const Triangle& triangle : kSquare) {
    out += "  facet normal 0 0 1\n    outer loop\n";
    for (const auto& [x, y, z] : triangle) {
      out += fmt::format("      vertex {} {:e} {}\n", x, y, z);
    }
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid square\n";
}

std::string binary_stl(const std::string& comment, std::uint16_t attributes = 0) {
  std::string out(84, '\0');
  out.replace(0, comment.size(), comment);
  const auto count = static_cast<std::uint32_t>(kSquare.size());
  std::memcpy(out.data() + 80, &count, 4);
  for (const Triangle& triangle : kSquare) {
    std::string bytes(50, '\0');
    std::memcpy(bytes.data() + 12, triangle.data(), 36);
    std::memcpy(bytes.data() + 48, &attributes, 2);
    out += bytes;
  }
  return out;
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string stl_error(const std::string& bytes) {
  std::vector<std::string> notices;
  return test::error_message(read_stl(bytes, "a.stl", notices));
}

TEST(Stl, BothFormatsGiveTheSameMesh) {
  for (const std::string& bytes :
       {ascii_stl(), binary_stl("made by hand"), binary_stl("solid, but binary"), ascii_stl() + "\r\n",
        binary_stl("padded") + "more", binary_stl("solid") + "more", "\xef\xbb\xbf " + upper(ascii_stl())}) {
    std::vector<std::string> notices;
    const Result<Mesh> mesh = read_stl(bytes, "a.stl", notices);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->positions, (std::vector<std::array<double, 3>>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh->triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_TRUE(mesh->normals.empty());
    EXPECT_TRUE(notices.empty());
  }
}

TEST(Stl, ColoursAreNamedAsLeftOut) {
  std::vector<std::string> notices;
  ASSERT_TRUE(read_stl(binary_stl("", 0x8421), "a.stl", notices).ok());
  EXPECT_EQ(notices, std::vector<std::string>{"left out: colours of a.stl, which programs write in different ways"});
}

TEST(Stl, ErrorsNameTheirPlace) {
  EXPECT_EQ(stl_error("ply\n"), "a.stl: an STL file begins with \"solid\", or is binary with at least 84 bytes");
  EXPECT_EQ(stl_error("solid x\nendsolid x\n"), "a.stl: there are no triangles");
  EXPECT_EQ(stl_error(binary_stl("").substr(0, 150)), "a.stl: the file ends before triangle 1 of 2");
  std::string huge = binary_stl("");
  huge.replace(80, 4, "\xff\xff\xff\xff");
  EXPECT_EQ(stl_error(huge), "a.stl: the file ends before triangle 2 of 4294967295");
  std::string text = ascii_stl();
  EXPECT_EQ(stl_error(text.substr(0, text.find("endloop"))), "a.stl: the file ends within a facet");
  EXPECT_EQ(stl_error(text.replace(text.find("vertex 1 "), 8, "vertex x")),
            "a.stl: line 5: vertex: three numbers are expected");
  text = ascii_stl();
  EXPECT_EQ(stl_error(text.erase(text.find("vertex"), 6)), "a.stl: line 8: a facet has 2 vertices, three are expected");
  text = ascii_stl();
  EXPECT_EQ(stl_error(text.replace(text.find("vertex 1 "), 8, "vertex 1e40")),
            "a.stl: triangle 0: coordinates must be finite and at most 1e30");
}

TEST(Stl, DamagedFilesAreReadOrRefused) {
  constexpr std::array<std::string_view, 6> kWords{"vertex ", "-1", "\n", "endfacet", "nan", "\xff\xff\xff\xff"};
  expect_both_outcomes({ascii_stl(), binary_stl(""), binary_stl("solid")}, 37, fuzz_cases(3000),
                       [&](const std::string& original, FuzzRandom& random) {
                         std::vector<std::string> notices;
                         const Result<Mesh> mesh = read_stl(mutate(original, kWords, random), "a.stl", notices);
                         EXPECT_TRUE(!mesh.ok() || validate(*mesh).ok());
                         EXPECT_TRUE(mesh.ok() || message_of(mesh.status()).starts_with("a.stl: ")) << mesh.status();
                         return mesh.ok();
                       });
}

}  // namespace
}  // namespace lightmill
