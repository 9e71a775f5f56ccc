// Compressed meshes (Draco) through the real decoder: exact and quantized arrays, damaged bytes, wrong counts, limits.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <set>

#include "common/base/sanitizers.h"
#include "common/image/decoder/decoder_process.h"
#include "decoder/draco_mesh.h"
#include "tests/fuzz/mutate.h"
#include "tests/support/draco_file.h"
#include "tests/support/error_message.h"
#include "tests/support/paths.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

DecoderOptions built_decoder() {
  return {.program = program("lightmill-image-decoder")};
}

template <class T>
std::vector<T> numbers(const std::string& bytes) {
  std::vector<T> out(bytes.size() / sizeof(T));
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

std::vector<std::uint32_t> corners_of(const DracoSource& source) {
  std::vector<std::uint32_t> out;
  for (const auto& triangle : source.triangles) {
    out.insert(out.end(), triangle.begin(), triangle.end());
  }
  return out;
}

TEST(DecodeMesh, SequentialMeshesWithoutQuantizationAreExact) {
  DecoderProcess decoder(built_decoder());
  for (const std::uint32_t side : {2u, 5u, 300u}) {  // the last one has more bytes than its pipe holds
    const DracoSource grid = draco_grid(side);
    const std::string file = draco_file(grid, DracoMethod::sequential);
    const Result<DecodedMesh> mesh = decoder.decode_mesh(as_byte_view(file), request_for(grid));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->corners, corners_of(grid));
    ASSERT_EQ(mesh->attributes.size(), grid.attributes.size());
    for (std::size_t i = 0; i < grid.attributes.size(); ++i) {
      EXPECT_TRUE(mesh->attributes[i] == grid.attributes[i].numbers) << i;
    }
  }
}

/// The corners of a triangle, each with all of its values, from the lowest one on.
using ShownTriangle = std::array<std::string, 3>;
ShownTriangle shown(const std::vector<std::string>& attributes, std::size_t vertices,
                    std::array<std::uint32_t, 3> corners) {
  ShownTriangle out;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::string& all : attributes) {
      const std::size_t size = all.size() / vertices;
      out[i] += all.substr(corners[i] * size, size);
    }
  }
  std::ranges::rotate(out, std::ranges::min_element(out));
  return out;
}

TEST(DecodeMesh, EdgebreakerKeepsTrianglesAndTheirValues) {
  DecoderProcess decoder(built_decoder());
  const DracoSource grid = draco_grid(9);
  std::multiset<ShownTriangle> expected;
  std::vector<std::string> values;
  for (const DracoAttribute& attribute : grid.attributes) {
    values.push_back(attribute.numbers);
  }
  for (const auto& triangle : grid.triangles) {
    expected.insert(shown(values, grid.vertices, triangle));
  }
  for (const int speed : {0, 5, 10}) {
    const std::string file = draco_file(grid, DracoMethod::edgebreaker, speed);
    const Result<DecodedMesh> mesh = decoder.decode_mesh(as_byte_view(file), request_for(grid));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    std::multiset<ShownTriangle> got;
    for (std::size_t i = 0; i < mesh->corners.size(); i += 3) {
      got.insert(
          shown(mesh->attributes, grid.vertices, {mesh->corners[i], mesh->corners[i + 1], mesh->corners[i + 2]}));
    }
    EXPECT_TRUE(got == expected) << "speed " << speed;
  }
}

TEST(DecodeMesh, QuantizedValuesAreWithinHalfAStep) {
  constexpr int kBits = 12;
  DracoSource grid = draco_grid(20);
  for (std::size_t i = 0; i < 3; ++i) {
    grid.attributes[i].quantization_bits = kBits;
  }
  DecoderProcess decoder(built_decoder());
  const std::string file = draco_file(grid, DracoMethod::sequential);
  const Result<DecodedMesh> mesh = decoder.decode_mesh(as_byte_view(file), request_for(grid));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const double steps = (1 << kBits) - 1;
  // Positions span 19, coordinates 0.95. Normals are points of an octahedron, whose diagonal is 2 in each axis: half a
  // step of both coordinates moves a direction by less than three steps of the unit sphere.
  const std::array<double, 3> most{0.5001 * 19 / steps, 0.5001 * 0.95 / steps, 3 * 2 / steps};
  for (const auto& [attribute, bound] : {std::pair{0, most[0]}, {2, most[1]}, {1, most[2]}}) {
    const auto got = numbers<float>(mesh->attributes[static_cast<std::size_t>(attribute)]);
    const auto expected = numbers<float>(grid.attributes[static_cast<std::size_t>(attribute)].numbers);
    double largest = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      largest = std::max(largest, std::abs(double{got[i]} - double{expected[i]}));
    }
    EXPECT_LE(largest, bound) << attribute;
    EXPECT_GT(largest, 0) << attribute;
  }
  EXPECT_TRUE(mesh->attributes[3] == grid.attributes[3].numbers) << "colours are integers";
}

TEST(DecodeMesh, NumbersHaveTheRequestedType) {
  const DracoSource grid = draco_grid(3);
  const std::string file = draco_file(grid, DracoMethod::sequential);
  DecoderProcess decoder(built_decoder());
  const Result<DecodedMesh> mesh =
      decoder.decode_mesh(as_byte_view(file), {9, 8, false, {{4, 5121, 4}, {3, 5126, 4}, {4, 5126, 4}}});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto joints = numbers<std::uint16_t>(grid.attributes[4].numbers);
  const auto colors = numbers<std::uint8_t>(grid.attributes[3].numbers);
  const auto bytes = numbers<std::uint8_t>(mesh->attributes[0]);
  const auto shades = numbers<float>(mesh->attributes[1]), floats = numbers<float>(mesh->attributes[2]);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    EXPECT_EQ(bytes[i], joints[i]);
    EXPECT_EQ(shades[i], static_cast<float>(colors[i]) / 255) << "normalized";
    EXPECT_EQ(floats[i], joints[i]);
  }
  EXPECT_EQ(error_message(decoder.decode_mesh(as_byte_view(file), {9, 8, false, {{0, 5121, 3}}})),
            "attribute 0 of the compressed data has floats, but type 5121 is expected");
  EXPECT_EQ(error_message(decoder.decode_mesh(as_byte_view(file), {9, 8, false, {{3, 5120, 4}}})),
            "attribute 3 has a value that its type 5120 cannot have");
}

TEST(DecodeMesh, WrongCountsAndAttributesAreNamed) {
  const DracoSource grid = draco_grid(3);
  const std::string file = draco_file(grid, DracoMethod::edgebreaker);
  DecoderProcess decoder(built_decoder());
  const auto error = [&](const MeshRequest& request) {
    return error_message(decoder.decode_mesh(as_byte_view(file), request));
  };
  const std::vector<CompressedAttribute> positions{{0, 5126, 3}};
  EXPECT_EQ(error({9, 8, false, positions}), "no error");
  EXPECT_EQ(error({8, 8, false, positions}), "the compressed data have 9 vertices, but 8 are expected");
  EXPECT_EQ(error({9, 9, false, positions}), "the compressed data have 8 triangles, but 9 are expected");
  EXPECT_EQ(error({9, 9, true, positions}), "no error");
  EXPECT_EQ(error({9, 7, true, positions}), "the compressed data have 8 triangles, but at most 7 are expected");
  EXPECT_EQ(error({9, 8, false, {{7, 5126, 3}}}), "the compressed data have no attribute 7");
  EXPECT_EQ(error({9, 8, false, {{2, 5126, 3}}}),
            "attribute 2 of the compressed data has 2 components, but 3 are expected");
  EXPECT_EQ(error({9, 8, false, {{2, 5130, 2}}}), "2 components of type 5130 are not supported");
  EXPECT_EQ(error({9, 8, false, {{2, 5126, 0}}}), "0 components of type 5126 are not supported");
  EXPECT_EQ(error({9, 8, false, std::vector<CompressedAttribute>(33, {0, 5126, 3})}),
            "33 attributes are more than the 32 that a compressed mesh may have");
  EXPECT_EQ(
      error({kMaxCompressedVertices + 1, 8, false, positions}),
      "33554433 vertices and 8 triangles are more than the 33554432 and 33554432 that a compressed mesh may have");
  EXPECT_EQ(error({kMaxCompressedVertices, 8, false, std::vector<CompressedAttribute>(32, {0, 5126, 4})}),
            "its arrays have more than the 4.00 GiB that a compressed mesh may have");
  EXPECT_EQ(error({kMaxCompressedVertices, kMaxCompressedTriangles, false, positions}),
            "the compressed data have 9 vertices, but 33554432 are expected");
}

TEST(DecodeMesh, FilesThatAreNoMeshAreRefused) {
  DecoderProcess decoder(built_decoder());
  const MeshRequest request = request_for(draco_grid(2));
  for (const std::string& bytes :
       {std::string(), std::string("DRACO"), std::string(1000, '\0'), std::string("\x89PNG")}) {
    const Status status = decoder.decode_mesh(as_byte_view(bytes), request).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_TRUE(message_of(status).starts_with("the compressed data are damaged")) << status;
  }
  std::string points = draco_file(draco_grid(2), DracoMethod::sequential);
  points[7] = 0;  // the kind of geometry: a point cloud
  EXPECT_NE(error_message(decoder.decode_mesh(as_byte_view(points), request)), "no error");
}

// Every eighth position of a file, from the parameter on.
class DamagedMeshes : public ::testing::TestWithParam<std::size_t> {};

INSTANTIATE_TEST_SUITE_P(Few, DamagedMeshes, ::testing::Values(0), ::testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Many, DamagedMeshes, ::testing::Range<std::size_t>(1, 8), ::testing::PrintToStringParamName());

// A damaged file gives arrays of the requested sizes with valid corners, or an error of its own. It does not affect the
// next file.
TEST_P(DamagedMeshes, EndWithAnErrorOrSoundArrays) {
  DecoderProcess decoder(built_decoder());
  FuzzRandom random(20 + GetParam());
  int errors = 0, decoded = 0;
  for (const DracoMethod method : {DracoMethod::sequential, DracoMethod::edgebreaker}) {
    DracoSource grid = draco_grid(3);
    grid.attributes[0].quantization_bits = 10;
    grid.attributes[1].quantization_bits = 8;
    const std::string file = draco_file(grid, method);
    const MeshRequest request = request_for(grid);
    const auto check = [&](const std::string& damaged, std::size_t at) {
      const Result<DecodedMesh> mesh = decoder.decode_mesh(as_byte_view(damaged), request);
      errors += mesh.ok() ? 0 : 1;
      decoded += mesh.ok() ? 1 : 0;
      if (!mesh.ok()) {
        const StatusCode code = mesh.status().code();
        EXPECT_TRUE(code == StatusCode::kInvalidArgument || code == StatusCode::kResourceExhausted) << mesh.status();
        return;
      }
      EXPECT_EQ(mesh->corners.size(), 3 * request.triangles) << at;
      EXPECT_LT(std::ranges::max(mesh->corners), request.vertices) << at;
      for (std::size_t i = 0; i < request.attributes.size(); ++i) {
        EXPECT_EQ(mesh->attributes[i].size(), grid.attributes[i].numbers.size()) << at;
      }
    };
    for (std::size_t at = GetParam(); at < file.size(); at += 8) {
      std::string damaged = file;
      damaged[at] = static_cast<char>(damaged[at] ^ static_cast<char>(1 + random.below(255)));
      check(damaged, at);
      if (at % 7 == 0) {
        check(file.substr(0, at), at);
      }
    }
    ASSERT_TRUE(decoder.decode_mesh(as_byte_view(file), request).ok());
  }
  EXPECT_GT(errors, 5);
  EXPECT_GT(decoded, 5);
}

/// A sequential mesh that says it has this many triangles and vertices, and ends there.
std::string boast(std::uint32_t triangles, std::uint32_t vertices) {
  std::string out("DRACO\x02\x02\x01\x00\x00\x00", 11);  // version 2.2, mesh, sequential, without flags
  for (std::uint64_t count : {triangles, vertices}) {
    for (; count >= 128; count >>= 7) {
      out += static_cast<char>(count | 128);
    }
    out += static_cast<char>(count);
  }
  return out + std::string("\x01", 1) + std::string(64, '\0');  // indices without compression
}

TEST(DecodeMesh, HugeCountsInTheDataCostNoMemory) {
  DecoderProcess decoder(built_decoder());
  for (const auto& [triangles, vertices] :
       {std::pair{1u << 31, 9u}, {1u << 30, 1u << 30}, {8u, 0xffffffffu}, {0xffffffffu, 0xffffffffu}}) {
    const Status status =
        decoder.decode_mesh(as_byte_view(boast(triangles, vertices)), request_for(draco_grid(3))).status();
    EXPECT_FALSE(status.ok());
    EXPECT_TRUE(status.code() == StatusCode::kInvalidArgument || status.code() == StatusCode::kResourceExhausted)
        << status;
  }
}

TEST(DecodeMesh, NeedsNoMoreMemoryThanItsLimit) {
  DecoderProcess decoder(built_decoder());
  const DracoSource large = draco_grid(kSanitized ? 100 : 400);
  for (const DracoMethod method : {DracoMethod::sequential, DracoMethod::edgebreaker}) {
    const std::string file = draco_file(large, method, 0);
    const Result<DecodedMesh> mesh = decoder.decode_mesh(as_byte_view(file), request_for(large));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
  }
}

TEST(DecodeMesh, LiesOfADecoderAreFoundOut) {
  const TemporaryFolder folder;
  const auto error_of = [&](const std::string& lie) {
    const std::filesystem::path liar = folder.path() / lie;
    std::filesystem::create_symlink(program("lying_decoder"), liar);
    DecoderProcess decoder({.program = liar});
    return error_message(decoder.decode_mesh(as_byte_view("bytes"), {9, 8, false, {{0, 5126, 3}, {1, 5121, 4}}}));
  };
  EXPECT_EQ(error_of("none"), "no error");
  EXPECT_EQ(error_of("long"), "no error") << "what is too much is not read";
  for (const std::string lie : {"more-vertices", "fewer-triangles", "many-triangles"}) {
    EXPECT_EQ(error_of(lie), "the mesh is damaged: its decoder sent an invalid reply") << lie;
  }
  EXPECT_EQ(error_of("outside"), "the compressed data are damaged: vertex 9 is out of range, there are 9");
  for (const std::string lie : {"nothing", "short"}) {
    EXPECT_EQ(error_of(lie), "the compressed data are damaged: the decoder sent less than it announced") << lie;
  }
}

TEST(DecodeMesh, AnAbsentDecoderIsReported) {
  DecoderProcess decoder({.program = "/nowhere/lightmill-image-decoder"});
  const DracoSource grid = draco_grid(2);
  const Status status =
      decoder.decode_mesh(as_byte_view(draco_file(grid, DracoMethod::sequential)), request_for(grid)).status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(message_of(status),
            "cannot start /nowhere/lightmill-image-decoder: No such file or directory. Install it beside this program");
}

}  // namespace
}  // namespace lightmill::test
