// Compressed buffer views of glTF files (EXT_meshopt_compression), made by meshoptimizer's encoders.
#include <meshoptimizer.h>

#include "tests/unit/scene_io/gltf_fixture.h"

namespace lightmill {
namespace {

using namespace lightmill::test;

std::string encoded_vertices(const std::string& bytes, std::size_t count, std::size_t stride) {
  std::string out(meshopt_encodeVertexBufferBound(count, stride), '\0');
  out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), bytes.data(), count,
                                        stride));
  return out;
}

std::string encoded_indices(const std::vector<unsigned>& indices, bool triangles) {
  std::string out(1000, '\0');
  auto* to = reinterpret_cast<unsigned char*>(out.data());
  out.resize(triangles ? meshopt_encodeIndexBuffer(to, out.size(), indices.data(), indices.size())
                       : meshopt_encodeIndexSequence(to, out.size(), indices.data(), indices.size()));
  return out;
}

/// A file whose views are compressed in buffers[0]. buffers[1] stands for the uncompressed bytes, which are not there.
class CompressedFile {
 public:
  /// Adds a view of `count` elements, and its accessor.
  void add(const std::string& bytes, std::string_view mode, std::size_t stride, std::size_t count,
           std::string_view accessor, std::string_view more = "") {
    views_ += fmt::format(
        R"({}{{"buffer":1,"byteLength":{},"byteStride":{},"extensions":{{"EXT_meshopt_compression":{{"buffer":0,"byteOffset":{},
"byteLength":{},"byteStride":{},"mode":"{}","count":{}{}}}}}}})",
        views_.empty() ? "" : ",", count * stride, stride, bytes_.size(), bytes.size(), stride, mode, count, more);
    accessors_ += fmt::format(R"({}{{"bufferView":{},"count":{},{}}})", accessors_.empty() ? "" : ",", views_count_++,
                              count, accessor);
    bytes_ += bytes;
  }
  std::string text(const std::string& attributes) const {
    return gltf(fmt::format(
        R"("buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}},{{"byteLength":1000,"extensions":{{"EXT_meshopt_compression":
{{"fallback":true}}}}}}],"bufferViews":[{}],"accessors":[{}],"extensionsRequired":["EXT_meshopt_compression"],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{{}}},"indices":1}}]}}])",
        bytes_.size(), base64(bytes_), views_, accessors_, attributes));
  }

 private:
  std::string bytes_, views_, accessors_;
  int views_count_ = 0;
};

const std::vector<float> kFourCorners{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
constexpr std::string_view kPositions = R"("type":"VEC3","componentType":5126)";
constexpr std::string_view kIndices = R"("type":"SCALAR","componentType":5123)";

CompressedFile square(bool triangles = true) {
  CompressedFile file;
  file.add(encoded_vertices(packed(kFourCorners), 4, 12), "ATTRIBUTES", 12, 4, kPositions);
  file.add(encoded_indices({0, 1, 2, 2, 1, 3}, triangles), triangles ? "TRIANGLES" : "INDICES", 2, 6, kIndices);
  return file;
}

TEST(GltfMeshopt, PositionsAndBothKindsOfIndicesAreDecoded) {
  for (const bool triangles : {true, false}) {
    const Mesh mesh = object_mesh(good(square(triangles).text(R"("POSITION":0)")));
    EXPECT_EQ(mesh.positions, (std::vector<Point3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
    ASSERT_EQ(mesh.triangles.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {  // the encoder may turn a triangle's corners
      const auto& t = mesh.triangles[i];
      const std::set<std::uint32_t> corners(t.begin(), t.end());
      EXPECT_EQ(corners, i == 0 ? (std::set<std::uint32_t>{0, 1, 2}) : (std::set<std::uint32_t>{1, 2, 3}));
    }
  }
}

TEST(GltfMeshopt, FiltersGiveUnitNormalsAndExactExponents) {
  CompressedFile file;
  // 2^−3 · 8 = 1: the exponent is the highest of the four bytes.
  std::vector<std::uint32_t> numbers;
  for (const float value : kFourCorners) {
    numbers.push_back(value == 0 ? 0 : 0xfd000008u);
  }
  file.add(encoded_vertices(packed(numbers), 4, 12), "ATTRIBUTES", 12, 4, kPositions, R"(,"filter":"EXPONENTIAL")");
  file.add(encoded_indices({0, 1, 2, 2, 1, 3}, true), "TRIANGLES", 2, 6, kIndices);
  // An octahedron's x and y, with 127 as 1: (0, 0) is +z, and (127, 0) is +x.
  const std::vector<std::int8_t> octahedral{0, 0, 127, 0, 127, 0, 127, 0, 0, 0, 127, 0, 0, 127, 127, 0};
  file.add(encoded_vertices(packed(octahedral), 4, 4), "ATTRIBUTES", 4, 4,
           R"("type":"VEC3","componentType":5120,"normalized":true)", R"(,"filter":"OCTAHEDRAL")");
  const Mesh mesh = object_mesh(good(file.text(R"("POSITION":0,"NORMAL":2)")));
  EXPECT_EQ(mesh.positions, (std::vector<Point3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
  EXPECT_EQ(mesh.normals, (std::vector<std::array<float, 3>>{{0, 0, 1}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}}));
}

TEST(GltfMeshopt, DamagedAndWrongViewsAreNamed) {
  const auto of = [](const std::string& bytes, std::string_view mode, std::size_t stride, std::size_t count,
                     std::string_view more = "") {
    CompressedFile file;
    file.add(bytes, mode, stride, count, kPositions, more);
    file.add(encoded_indices({0, 1, 2}, true), "TRIANGLES", 2, 3, kIndices);
    return error_message(read(file.text(R"("POSITION":0)")));
  };
  const std::string at = "a.gltf: bufferViews[0].extensions.EXT_meshopt_compression";
  const std::string good = encoded_vertices(packed(kFourCorners), 4, 12);
  EXPECT_EQ(of(good.substr(0, good.size() - 3), "ATTRIBUTES", 12, 4).substr(0, at.size() + 29),
            at + ": the compressed data are dam");
  EXPECT_EQ(of(good, "VERTICES", 12, 4), at + R"(.mode: ATTRIBUTES, TRIANGLES or INDICES is expected, got "VERTICES")");
  EXPECT_EQ(of(good, "ATTRIBUTES", 6, 4), at + ".byteStride: 4, 8, … is expected for ATTRIBUTES, got 6");
  EXPECT_EQ(of(good, "ATTRIBUTES", 0, 4), at + ".byteStride: a whole number from 1 to 256 is expected, got 0");
  EXPECT_EQ(of(good, "TRIANGLES", 2, 4), at + ".count: a number of whole elements is expected");
  EXPECT_EQ(of(good, "ATTRIBUTES", 12, 1u << 30),
            at + fmt::format(".count: {} bytes cannot hold 1073741824 elements of 12 bytes", good.size()));
  EXPECT_EQ(
      of(good, "ATTRIBUTES", 12, 4, R"(,"filter":"OCTAHEDRAL")"),
      at +
          R"(.filter: NONE, OCTAHEDRAL (stride 4 or 8), QUATERNION (8) or EXPONENTIAL (4, 8, …) is expected, got "OCTAHEDRAL" with stride 12)");
}

}  // namespace
}  // namespace lightmill
