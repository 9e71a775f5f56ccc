// Compressed primitives of glTF files (KHR_draco_mesh_compression), made by Draco's encoder and read through the real
// decoder.
#include "common/image/decoder/decoder_process.h"
#include "tests/fuzz/mutate.h"
#include "tests/support/draco_file.h"
#include "tests/support/paths.h"
#include "tests/unit/scene_io/gltf_fixture.h"

namespace lightmill {
namespace {

using namespace lightmill::test;

const std::vector<std::string> kNames{"POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0", "JOINTS_0", "WEIGHTS_0"};

/// Reads with the real decoder, and counts how often it is called.
class Reader {
 public:
  Result<LoadedScene> read(const std::string& text) {
    GltfOptions options;
    options.decode_mesh = [this](ByteView bytes, const MeshRequest& request) {
      ++calls;
      return decoder_.decode_mesh(bytes, request);
    };
    return read_gltf(text, "a.gltf", options, no_files);
  }
  LoadedScene good(const std::string& text) { return good_scene(read(text)); }
  std::string error(const std::string& text) { return error_message(read(text)); }

  int calls = 0;

 private:
  DecoderProcess decoder_{{.program = program("lightmill-image-decoder")}};
};

std::string type_of(std::uint32_t components) {
  return components == 1 ? "SCALAR" : fmt::format("VEC{}", components);
}

std::string corners_of(const DracoSource& source) {
  std::vector<std::uint32_t> out;
  for (const auto& triangle : source.triangles) {
    out.insert(out.end(), triangle.begin(), triangle.end());
  }
  return packed(out);
}

/// The members of a primitive's extension. Draco's ids are those of the source's attributes.
std::string extension_of(std::size_t attributes, int view = 0) {
  std::string ids;
  for (std::size_t i = 0; i < attributes; ++i) {
    ids += fmt::format(R"({}"{}":{})", i == 0 ? "" : ",", kNames[i], i);
  }
  return fmt::format(R"(,"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":{},"attributes":{{{}}}}}}})", view,
                     ids);
}

std::string attributes_of(std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) {
    out += fmt::format(R"({}"{}":{})", i == 0 ? "" : ",", kNames[i], i);
  }
  return out;
}

/// Accessors of the attributes, then of the corners. Without data: their "bufferView" is not there.
std::string accessors_of(const DracoSource& source) {
  std::string out;
  for (const DracoAttribute& attribute : source.attributes) {
    out += fmt::format(R"({{"count":{},"type":"{}","componentType":{},"normalized":{}}},)", source.vertices,
                       type_of(attribute.components), attribute.type, attribute.normalized);
  }
  return out + fmt::format(R"({{"count":{},"type":"SCALAR","componentType":5125}})", 3 * source.triangles.size());
}

/// A material that uses the texture coordinates.
const std::string kTextured = fmt::format(
    R"("images":[{{"uri":"data:;base64,{}"}}],"textures":[{{"source":0}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}])",
    base64(kPng));
const std::string kPlain = R"("materials":[{}],"nodes":[{"mesh":0}])";
const std::string kStill = kTextured + R"(,"nodes":[{"mesh":0}])";
/// A skin of two joints moves the vertices by their weights.
const std::string kSkinned = kTextured + R"(,"skins":[{"joints":[1,2]}],"scenes":[{"nodes":[0,1,2]}],
"nodes":[{"mesh":0,"skin":0},{"translation":[0,0,1]},{"translation":[0,3,0],"scale":[2,1,1]}])";

std::string primitive_of(const DracoSource& source, const std::string& more) {
  return fmt::format(R"({{"attributes":{{{}}},"indices":{},"material":0{}}})", attributes_of(source.attributes.size()),
                     source.attributes.size(), more);
}

struct CompressedFile {
  std::string bytes;      ///< of Draco
  std::string accessors;  ///< a list without its brackets
  std::string primitives;
  std::string scene;

  std::string text() const {
    return gltf(fmt::format(
        R"("extensionsRequired":["KHR_draco_mesh_compression"],"buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}],"bufferViews":[{{"buffer":0,"byteLength":{}}}],
"accessors":[{}],"meshes":[{{"primitives":[{}]}}],{})",
        bytes.size(), base64(bytes), bytes.size(), accessors, primitives, scene));
  }
};

CompressedFile compressed(const DracoSource& source, const std::string& scene,
                          DracoMethod method = DracoMethod::sequential) {
  return {draco_file(source, method), accessors_of(source),
          primitive_of(source, extension_of(source.attributes.size())), scene};
}

std::string uncompressed(const DracoSource& source, const std::string& scene, const std::string& more = "") {
  GltfBuffer buffer;
  for (const DracoAttribute& attribute : source.attributes) {
    buffer.add(attribute.numbers, type_of(attribute.components), static_cast<int>(attribute.type), source.vertices,
               attribute.normalized ? R"(,"normalized":true)" : "");
  }
  buffer.add(corners_of(source), "SCALAR", 5125, 3 * source.triangles.size());
  return gltf(
      fmt::format(R"({},"meshes":[{{"primitives":[{}]}}],{})", buffer.embedded(), primitive_of(source, more), scene));
}

TEST(GltfDraco, SequentialMeshesAreThoseOfTheUncompressedFile) {
  const DracoSource grid = draco_grid(5);
  Reader reader;
  const Mesh expected = object_mesh(good(uncompressed(grid, kSkinned)));
  const Mesh got = object_mesh(reader.good(compressed(grid, kSkinned).text()));
  EXPECT_FALSE(expected.normals.empty() || expected.texture_coordinates.empty() || expected.colors.empty());
  EXPECT_NE(expected.positions[0][2], 0) << "the skin moves it";
  EXPECT_TRUE(encode_mesh(got) == encode_mesh(expected));
  EXPECT_EQ(reader.calls, 1);
}

TEST(GltfDraco, QuantizedMeshesAreNearTheUncompressedOnes) {
  DracoSource grid = draco_grid(12);
  grid.attributes.resize(4);  // no skin
  for (std::size_t i = 0; i < 3; ++i) {
    grid.attributes[i].quantization_bits = 12;
  }
  CompressedFile file = compressed(grid, kStill);
  Reader reader;
  const Mesh exact = object_mesh(good(uncompressed(grid, kStill)));
  const Mesh sequential = object_mesh(reader.good(file.text()));
  ASSERT_EQ(sequential.positions.size(), exact.positions.size());
  EXPECT_EQ(sequential.triangles, exact.triangles);
  EXPECT_TRUE(sequential.colors == exact.colors);
  const double position_step = 11.0 / 4095, coordinate_step = 1.0 / 4095, normal_step = 6.0 / 4095;
  for (std::size_t i = 0; i < exact.positions.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(sequential.positions[i][k], exact.positions[i][k], 0.51 * position_step);
      EXPECT_NEAR(sequential.normals[i][k], exact.normals[i][k], normal_step);
    }
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(sequential.texture_coordinates[i][k], exact.texture_coordinates[i][k], 0.51 * coordinate_step);
    }
  }
  // Edgebreaker has another order of vertices. Its area is the same.
  file.bytes = draco_file(grid, DracoMethod::edgebreaker);
  const Mesh edgebreaker = object_mesh(reader.good(file.text()));
  EXPECT_EQ(edgebreaker.triangles.size(), exact.triangles.size());
  const auto sum = [](const Mesh& mesh) {
    double total = 0;
    for (const auto& t : mesh.triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        const Point3d &a = mesh.positions[t[i]], &b = mesh.positions[t[(i + 1) % 3]];
        total += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
      }
    }
    return total;
  };
  EXPECT_NEAR(sum(edgebreaker), sum(sequential), 1e-4 * sum(exact));
}

// So that the scene is the same with and without a decoder.
TEST(GltfDraco, UncompressedDataBesideTheCompressedOnesCount) {
  const DracoSource grid = draco_grid(3);
  // The extension names a view that is no Draco file.
  const std::string both = uncompressed(grid, kSkinned, extension_of(grid.attributes.size()));
  Reader reader;
  const std::string expected = encode_mesh(object_mesh(good(uncompressed(grid, kSkinned))));
  EXPECT_TRUE(encode_mesh(object_mesh(reader.good(both))) == expected);
  EXPECT_TRUE(encode_mesh(object_mesh(good(both))) == expected) << "without a decoder";
  EXPECT_EQ(reader.calls, 0);
  EXPECT_EQ(
      error_message(read(compressed(grid, kSkinned).text())),
      "a.gltf: meshes[0].primitives[0]: its geometry is compressed (KHR_draco_mesh_compression), and there is none "
      "beside it: export it without compression");
}

TEST(GltfDraco, AttributesOutsideOfTheExtensionAreRead) {
  DracoSource grid = draco_grid(4);
  const DracoAttribute weights = grid.attributes.back();
  CompressedFile file = compressed(grid, kSkinned);
  // The weights are in a view of their own.
  file.primitives.replace(file.primitives.find(R"(,"WEIGHTS_0":5}}})"), std::string(R"(,"WEIGHTS_0":5}}})").size(),
                          "}}}");
  std::string text = file.text();
  const std::string accessor = R"({"count":16,"type":"VEC4","componentType":5126,"normalized":false})";
  text.replace(text.find(accessor), accessor.size(),
               R"({"count":16,"type":"VEC4","componentType":5126,"bufferView":1})");
  text.replace(text.find(R"("bufferViews":[)"), 15,
               fmt::format(R"("bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":1,"byteLength":{}}}],"none":[)",
                           file.bytes.size(), weights.numbers.size()));
  text.replace(text.find(R"(}],"bufferViews")"), 2,
               fmt::format(R"(}},{{"byteLength":{},"uri":"data:;base64,{}"}}])", weights.numbers.size(),
                           base64(weights.numbers)));
  Reader reader;
  EXPECT_TRUE(encode_mesh(object_mesh(reader.good(text))) ==
              encode_mesh(object_mesh(good(uncompressed(grid, kSkinned)))));
}

TEST(GltfDraco, PrimitivesShareABufferViewAndAccessors) {
  DracoSource grid = draco_grid(3), other = draco_grid(3);
  grid.attributes.resize(1);
  other.attributes.resize(1);
  for (char& byte : other.attributes[0].numbers) {  // from floats to others of the same sign and size
    byte = static_cast<char>(byte ^ 1);
  }
  CompressedFile file = compressed(grid, kPlain);
  const std::string first = draco_file(grid, DracoMethod::sequential);
  const std::string second = draco_file(other, DracoMethod::sequential);
  file.bytes = first + second;
  const std::string extension =
      R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":1,"attributes":{"POSITION":0}}})";
  // Two have one buffer view. The third has the same accessors and another view.
  file.primitives += "," + primitive_of(grid, extension_of(1)) + "," + primitive_of(grid, extension);
  std::string text = file.text();
  const std::string views = fmt::format(R"("bufferViews":[{{"buffer":0,"byteLength":{}}}])", file.bytes.size());
  text.replace(
      text.find(views), views.size(),
      fmt::format(R"("bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}}])",
                  first.size(), first.size(), second.size()));
  Reader reader;
  const LoadedScene loaded = reader.good(text);
  ASSERT_EQ(loaded.scene.objects.size(), 3u);
  EXPECT_EQ(reader.calls, 2);
  EXPECT_TRUE(object_mesh(loaded, 0).positions == object_mesh(loaded, 1).positions);
  EXPECT_FALSE(object_mesh(loaded, 0).positions == object_mesh(loaded, 2).positions);
}

TEST(GltfDraco, StripsAndPrimitivesWithoutIndicesAreTriangles) {
  DracoSource grid = draco_grid(3);
  grid.attributes.resize(1);
  CompressedFile file = compressed(grid, kPlain);
  Reader reader;
  const Mesh expected = object_mesh(reader.good(file.text()));
  const std::string indices = R"("indices":1,)";
  const std::size_t at = file.primitives.find(indices);
  std::string changed = file.primitives;
  changed.erase(at, indices.size());
  for (const std::string& primitives : {changed, std::string(file.primitives).insert(at, R"("mode":5,)")}) {
    CompressedFile other = file;
    other.primitives = primitives;
    EXPECT_TRUE(object_mesh(reader.good(other.text())).triangles == expected.triangles);
  }
  file.primitives.insert(at, R"("mode":6,)");
  EXPECT_EQ(reader.error(file.text()),
            "a.gltf: meshes[0].primitives[0].mode: compressed geometry must be triangles (4) or strips (5), got 6");
}

TEST(GltfDraco, MistakesAreNamed) {
  DracoSource grid = draco_grid(3);
  grid.attributes.resize(2);
  CompressedFile file = compressed(grid, kPlain);
  Reader reader;
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = file.text();
    EXPECT_NE(text.find(from), text.npos) << from;
    text.replace(text.find(from), from.size(), to);
    return reader.error(text);
  };
  const std::string at = "a.gltf: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression";
  EXPECT_EQ(changed("{", "{"), "no error");
  EXPECT_EQ(changed(R"("count":9)", R"("count":10)"),
            at + ": the compressed data have 9 vertices, but 10 are expected");
  EXPECT_EQ(changed(R"("count":24)", R"("count":27)"),
            at + ": the compressed data have 8 triangles, but 9 are expected");
  EXPECT_EQ(changed(R"("count":24)", R"("count":25)"),
            "a.gltf: accessors[2].count: 25 corners make no whole number of triangles");
  EXPECT_EQ(changed(R"("count":9,"type":"VEC3","componentType":5126,"normalized":false},{"count":24)",
                    R"("count":8,"type":"VEC3","componentType":5126},{"count":24)"),
            "a.gltf: meshes[0].primitives[0].attributes.NORMAL: 9 normals are expected, got 8");
  EXPECT_EQ(changed(R"("count":9)", R"("count":2147483648)"),
            at + ": 2147483648 vertices and 8 triangles are more than the 33554432 and 33554432 that a compressed mesh "
                 "may have");
  EXPECT_EQ(
      changed(R"("count":24)", R"("count":2147483646)"),
      at + ": 9 vertices and 715827882 triangles are more than the 33554432 and 33554432 that a compressed mesh may "
           "have");
  EXPECT_EQ(changed(R"("count":9)", R"("count":33554432)"),
            at + ": the compressed data have 9 vertices, but 33554432 are expected");
  EXPECT_EQ(changed(R"("NORMAL":1}}})", R"("NORMAL":7}}})"), at + ": the compressed data have no attribute 7");
  EXPECT_EQ(changed(R"("NORMAL":1}}})", R"("NORMAL":-1}}})"),
            at + ".attributes.NORMAL: a whole number from 0 to 4294967295 is expected, got -1");
  EXPECT_EQ(changed(R"({"POSITION":0,"NORMAL":1}}})", R"({"NORMAL":1}}})"),
            "a.gltf: meshes[0].primitives[0]: its positions are not in the file: accessors[0] has no bufferView");
  EXPECT_EQ(changed(R"("type":"VEC3")", R"("type":"VEC2")"),
            at + ": attribute 0 of the compressed data has 3 components, but 2 are expected");
  EXPECT_EQ(changed(R"("type":"VEC3")", R"("type":"MAT4")"),
            "a.gltf: accessors[0].type: SCALAR, VEC2, VEC3 or VEC4 is expected, got \"MAT4\"");
  EXPECT_EQ(changed("5126", "5124"),
            "a.gltf: accessors[0].componentType: 5120, 5121, 5122, 5123, 5125 or 5126 is expected, got 5124");
  EXPECT_EQ(changed("5126", "5121"), at + ": attribute 0 of the compressed data has floats, but type 5121 is expected");
  EXPECT_EQ(changed(R"("bufferView":0)", R"("bufferView":3)"),
            at + ".bufferView: an index into the 1 bufferViews is expected, got 3");
}

TEST(GltfDraco, DamagedBytesGiveAnErrorWithItsPlaceOrAMesh) {
  DracoSource grid = draco_grid(3);
  grid.attributes.resize(3);
  grid.attributes[0].quantization_bits = 11;
  CompressedFile file = compressed(grid, kPlain, DracoMethod::edgebreaker);
  const std::string whole = file.bytes;
  Reader reader;
  FuzzRandom random(21);
  int errors = 0;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    file.bytes = whole;
    file.bytes[at] = static_cast<char>(file.bytes[at] ^ static_cast<char>(1 + random.below(255)));
    const Result<LoadedScene> loaded = reader.read(file.text());
    if (!loaded.ok()) {
      ++errors;
      EXPECT_TRUE(message_of(loaded.status()).starts_with("a.gltf: meshes[0].primitives[0]")) << loaded.status();
    }
  }
  EXPECT_GT(errors, 20);
}

// Errors of a machine are not errors of the file.
TEST(GltfDraco, ErrorsKeepTheirCode) {
  const CompressedFile file = compressed(draco_grid(2), kStill);
  for (const StatusCode code :
       {StatusCode::kFailedPrecondition, StatusCode::kResourceExhausted, StatusCode::kCancelled}) {
    const GltfOptions options{
        .decode_mesh = [&](ByteView, const MeshRequest&) -> Result<DecodedMesh> { return make_error(code, "why"); }};
    const Status status = read_gltf(file.text(), "a.gltf", options, no_files).status();
    EXPECT_EQ(status.code(), code);
    EXPECT_EQ(message_of(status), "a.gltf: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: why");
  }
}

}  // namespace
}  // namespace lightmill
