#include "common/scene/mesh.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "tests/support/error_message.h"

namespace lightmill {
namespace {

Mesh triangle() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 1e-300}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

Mesh smooth_triangle() {
  Mesh mesh = triangle();
  mesh.normals.assign(3, {0, 0, 1});
  return mesh;
}

Mesh textured_triangle() {
  Mesh mesh = triangle();
  mesh.texture_coordinates = {{0, 0}, {1, -2.5f}, {1e9f, 0.25f}};
  return mesh;
}

Mesh smooth_textured_triangle() {
  Mesh mesh = textured_triangle();
  mesh.normals.assign(3, {0, 1, 0});
  return mesh;
}

Mesh coloured_triangle() {
  Mesh mesh = smooth_textured_triangle();
  mesh.colors = {{0, 0.5f, 1, 1}, {1, 1, 1, 0.25f}, {0, 0, 0, 0}};
  return mesh;
}

using test::error_message;

std::string decode_error(const std::string& bytes) {
  return error_message(decode_mesh(as_byte_view(bytes)).status());
}

void set_u32(std::string& bytes, std::size_t offset, std::uint32_t value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

TEST(Mesh, SurvivesARoundTripThroughItsBytes) {
  for (const Mesh& mesh :
       {triangle(), smooth_triangle(), textured_triangle(), smooth_textured_triangle(), coloured_triangle()}) {
    const std::string bytes = encode_mesh(mesh);
    const Result<Mesh> back = decode_mesh(as_byte_view(bytes));
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(back->positions, mesh.positions);
    EXPECT_EQ(back->normals, mesh.normals);
    EXPECT_EQ(back->texture_coordinates, mesh.texture_coordinates);
    EXPECT_EQ(back->colors, mesh.colors);
    EXPECT_EQ(back->triangles, mesh.triangles);
    EXPECT_EQ(encode_mesh(*back), bytes);
  }
}

TEST(Mesh, TheEncodingIsTheDocumentedOne) {
  const std::string bytes = encode_mesh(triangle());
  ASSERT_EQ(bytes.size(), 16u + 3 * 24 + 12);
  EXPECT_EQ(bytes.substr(0, 16), std::string("LMM1\0\0\0\0\3\0\0\0\1\0\0\0", 16));
  double x = 0;
  std::memcpy(&x, bytes.data() + 16 + 24, sizeof x);
  EXPECT_EQ(x, 1.0);
  const std::string full = encode_mesh(smooth_textured_triangle());
  ASSERT_EQ(full.size(), 16u + 3 * (24 + 12 + 8) + 12);
  EXPECT_EQ(full.substr(0, 16), std::string("LMM1\3\0\0\0\3\0\0\0\1\0\0\0", 16));
  float v = 0;
  std::memcpy(&v, full.data() + 16 + 3 * (24 + 12) + 8 + 4, sizeof v);
  EXPECT_EQ(v, -2.5f);
  EXPECT_EQ(encode_mesh(textured_triangle())[4], 2);
  const std::string coloured = encode_mesh(coloured_triangle());
  ASSERT_EQ(coloured.size(), 16u + 3 * (24 + 12 + 8 + 16) + 12);
  EXPECT_EQ(coloured[4], 1 + 2 + 8);
  float alpha = 0;
  std::memcpy(&alpha, coloured.data() + 16 + 3 * (24 + 12 + 8) + 16 + 12, sizeof alpha);
  EXPECT_EQ(alpha, 0.25f);
}

TEST(Mesh, TangentsSurviveTheRoundTrip) {
  Mesh mesh = smooth_textured_triangle();
  mesh.tangents = {{1, 0, 0, 1}, {0, 0.6f, 0.8f, -1}, {0, 0, -1, 1}};
  const std::string bytes = encode_mesh(mesh);
  ASSERT_EQ(bytes.size(), 16u + 3 * (24 + 12 + 8 + 16) + 12);
  EXPECT_EQ(bytes[4], 7);
  const Result<Mesh> back = decode_mesh(as_byte_view(bytes));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->tangents, mesh.tangents);
  EXPECT_EQ(encode_mesh(*back), bytes);
  mesh.tangents[1][3] = 0.5f;
  EXPECT_EQ(error_message(validate(mesh)),
            "tangents[1]: a unit vector and a sign are expected, got (0, 0.6, 0.8, 0.5)");
  mesh.tangents.pop_back();
  EXPECT_EQ(error_message(validate(mesh)), "tangents: none or one for each of 3 positions are expected, got 2");
}

TEST(Mesh, MistakesAreNamed) {
  EXPECT_EQ(error_message(validate(Mesh{})), "triangles: the mesh is empty, at least one triangle is expected");
  Mesh mesh = triangle();
  mesh.triangles.push_back({0, 1, 3});
  EXPECT_EQ(error_message(validate(mesh)), "triangles[1]: index 3 is out of range, there are 3 positions");
  mesh = triangle();
  mesh.positions[2][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_message(validate(mesh)),
            "positions[2]: coordinates must be finite and at most 1000000000000, got nan");
  mesh.positions[2][1] = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(error_message(validate(mesh)),
            "positions[2]: coordinates must be finite and at most 1000000000000, got -inf");
  mesh = smooth_triangle();
  mesh.normals.pop_back();
  EXPECT_EQ(error_message(validate(mesh)), "normals: none or one for each of 3 positions are expected, got 2");
  mesh = smooth_triangle();
  mesh.normals[1] = {0, 0, 0.5f};
  EXPECT_EQ(error_message(validate(mesh)), "normals[1]: a unit vector is expected, got (0, 0, 0.5)");
  mesh = textured_triangle();
  mesh.texture_coordinates.pop_back();
  EXPECT_EQ(error_message(validate(mesh)),
            "texture_coordinates: none or one for each of 3 positions are expected, got 2");
  mesh = textured_triangle();
  mesh.texture_coordinates[1][1] = -std::numeric_limits<float>::infinity();
  EXPECT_EQ(error_message(validate(mesh)),
            "texture_coordinates[1]: must be finite and at most 1000000000, got (1, -inf)");
}

TEST(Mesh, ColoursAreInZeroToOne) {
  Mesh mesh = coloured_triangle();
  for (const float value : {-0.001f, 1.001f, std::numeric_limits<float>::quiet_NaN()}) {
    mesh.colors[2][3] = value;
    EXPECT_EQ(error_message(validate(mesh)), fmt::format("colors[2]: must be in [0, 1], got {}", value));
  }
  mesh.colors.pop_back();
  EXPECT_EQ(error_message(validate(mesh)), "colors: none or one for each of 3 positions are expected, got 2");
}

TEST(Mesh, HostileBytesAreRefused) {
  std::string bytes = encode_mesh(triangle());
  EXPECT_EQ(decode_error(""), "mesh: 0 bytes are less than a header");
  EXPECT_EQ(decode_error("OFF1" + bytes.substr(4)), "mesh: the bytes do not begin as an LMM1 mesh");
  EXPECT_EQ(decode_error(bytes + "x"), "mesh: 3 positions and 1 triangles take 84 bytes, got 85");
  std::string flagged = bytes;
  set_u32(flagged, 4, 16);
  EXPECT_EQ(decode_error(flagged), "mesh: the bytes do not begin as an LMM1 mesh");
  set_u32(flagged, 4, 2);
  EXPECT_EQ(decode_error(flagged), "mesh: 3 positions and 1 triangles take 108 bytes, got 84");
  std::string huge = bytes;
  set_u32(huge, 4, 1);
  set_u32(huge, 8, 0xffffffffu);
  set_u32(huge, 12, 0xffffffffu);
  EXPECT_EQ(decode_error(huge), "mesh: 4294967295 positions and 4294967295 triangles take 206158430160 bytes, got 84");
  std::string wild = bytes;
  set_u32(wild, wild.size() - 4, 99);
  EXPECT_EQ(decode_error(wild), "mesh: triangles[0]: index 99 is out of range, there are 3 positions");
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(decode_mesh(as_byte_view(bytes.substr(0, length))).ok()) << length;
  }
}

}  // namespace
}  // namespace lightmill
