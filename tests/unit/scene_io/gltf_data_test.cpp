#include "common/scene_io/gltf/gltf_data.h"

#include <gtest/gtest.h>

#include "common/scene_io/gltf/gltf.h"
#include "common/scene_io/gltf/gltf_mesh.h"
#include "tests/unit/scene_io/gltf_fixture.h"

namespace lightmill {
namespace {

using test::gltf;
using test::GltfBuffer;
using test::no_files;
using test::packed;

std::unique_ptr<GltfData> open(const std::string& text, const FileSource& files = no_files) {
  Result<std::unique_ptr<GltfData>> data = GltfData::open(text, "a.gltf", files);
  EXPECT_TRUE(data.ok()) << data.status();
  return data.ok() ? *std::move(data) : nullptr;
}

std::string open_error(const std::string& text, const FileSource& files = no_files) {
  return test::error_message(GltfData::open(text, "a.gltf", files));
}

/// The mesh of a primitive, given as JSON.
std::optional<Mesh> primitive(const GltfBuffer& buffer, const std::string& json, std::string& error,
                              std::vector<std::string>& notices, std::optional<std::uint64_t> set = std::nullopt) {
  const auto data = open(gltf(fmt::format(R"({},"meshes":[{{"primitives":[{}]}}])", buffer.embedded(), json)));
  Notices list(notices);
  std::uint64_t deformed = 0;
  const auto mesh =
      read_primitive(*data, data->root()["meshes"].at(0)["primitives"].at(0), {}, set, false, deformed, list);
  error = test::error_message(data->status());
  const std::vector<std::string> faults = data->faults().notices();
  notices.insert(notices.end(), faults.begin(), faults.end());
  return mesh;
}

Mesh good_primitive(const GltfBuffer& buffer, const std::string& json,
                    std::optional<std::uint64_t> set = std::nullopt) {
  std::string error;
  std::vector<std::string> notices;
  const auto mesh = primitive(buffer, json, error, notices, set);
  EXPECT_TRUE(mesh.has_value()) << error;
  return mesh.value_or(Mesh{});
}

std::string bad_primitive(const GltfBuffer& buffer, const std::string& json) {
  std::string error;
  std::vector<std::string> notices;
  EXPECT_FALSE(primitive(buffer, json, error, notices).has_value());
  return error;
}

using Triangles = std::vector<std::array<std::uint32_t, 3>>;
const std::vector<float> kSquarePositions{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 2, 2};

TEST(Gltf, ReadingsOfSharedBytesAreLimited) {
  const auto read_times = [](int count) {
    GltfBuffer buffer;  // of 36 bytes, which may be read 8 times
    buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    std::string primitives;
    for (int i = 0; i < count; ++i) {
      primitives += fmt::format(R"({}{{"attributes":{{"POSITION":0}}}})", i == 0 ? "" : ",");
    }
    const std::string text = gltf(
        fmt::format(R"({},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}])", buffer.embedded(), primitives));
    return read_gltf(text, "a.gltf", {.most_shared_bytes = 0}, no_files);
  };
  EXPECT_TRUE(read_times(8).ok()) << read_times(8).status();
  const std::string error = test::error_message(read_times(9));
  EXPECT_EQ(
      error.find("a.gltf: meshes[0].primitives[8].attributes.POSITION: the file's accessors share bytes, and would "
                 "read more than "),
      0u)
      << error;
}

TEST(Gltf, BuffersComeFromAnywhere) {
  GltfBuffer buffer;
  buffer.positions(kSquarePositions);
  const std::string mesh = R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}])";
  const auto first = [](const GltfData& data) {
    const auto positions = data.vectors<3>(data.root()["meshes"].at(0)["primitives"].at(0)["attributes"]["POSITION"]);
    EXPECT_EQ(positions.size(), 5u) << data.status();
    return positions.empty() ? 0 : positions[4][2];
  };
  EXPECT_EQ(first(*open(gltf(buffer.embedded() + mesh))), 2);
  EXPECT_EQ(first(*open(test::glb(gltf(buffer.members("") + mesh), buffer.bytes()))), 2);
  std::string asked;
  EXPECT_EQ(first(*open(gltf(buffer.members("my%20data.bin") + mesh),
                        [&](const std::string& name) -> Result<SourceFile> {
                          asked = name;
                          return SourceFile{name, buffer.bytes()};
                        })),
            2);
  EXPECT_EQ(asked, "my data.bin");
}

TEST(Gltf, ContainerMistakesAreNamed) {
  EXPECT_EQ(open_error("[1]"), "a.gltf: a JSON object is expected");
  EXPECT_EQ(
      open_error("{\n\"asset\": }"),
      "a.gltf: its JSON is wrong at line 2, column 10, so the file is damaged: export it again: syntax error while "
      "parsing value - unexpected '}'; expected '[', '{', or a literal");
  EXPECT_EQ(open_error(R"({"asset":{"version":"1.0"}})"), "a.gltf: asset.version: glTF 2.0 is expected, got \"1.0\"");
  EXPECT_EQ(open_error(R"({"asset":{"version":"2.1","minVersion":"2.1"}})"),
            "a.gltf: asset.minVersion: only glTF 2.0 is supported, the file needs \"2.1\"");
  EXPECT_EQ(open_error("{}"), "a.gltf: asset.version: glTF 2.0 is expected, got \"\"");
  EXPECT_EQ(open_error(gltf(R"("buffers":[{"byteLength":4}])")),
            "a.gltf: buffers[0].uri: must be given, as the file has no binary chunk for it");
  EXPECT_EQ(open_error(gltf(R"("buffers":[{"byteLength":4,"uri":"x.bin"}])")),
            "a.gltf: buffers[0].uri: cannot open x.bin");
  EXPECT_EQ(open_error(gltf(R"("buffers":[{"byteLength":4,"uri":"https://x/y.bin"}])")),
            "a.gltf: buffers[0].uri: a file or a data URI is expected, got \"https://x/y.bin\"");
  EXPECT_EQ(open_error(gltf(R"("buffers":[{"byteLength":4,"uri":"data:,abc"}])")),
            "a.gltf: buffers[0].uri: a data URI with base64 is expected");
  EXPECT_EQ(open_error(gltf(R"("buffers":[{"byteLength":4,"uri":"data:;base64,AAAA"}])")),
            "a.gltf: buffers[0].byteLength: 4 bytes are expected, 3 are there");
  EXPECT_EQ(open_error(gltf(R"("buffers":{})")), "a.gltf: buffers: a list is expected, got an object");
  EXPECT_TRUE(open_error(test::glb("{\n \"asset\": }", "abcd"))
                  .starts_with("a.gltf: the JSON within it is wrong at line 2, column 11, so the file is damaged"))
      << open_error(test::glb("{\n \"asset\": }", "abcd"));
  EXPECT_LT(open_error("{\"asset\": " + std::string(std::size_t{2} << 20, 'x') + "}").size(), 700u);
  const std::string whole = test::glb(gltf(R"("buffers":[{"byteLength":4}])"), "abcd");
  EXPECT_EQ(open_error(whole), "no error");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(open_error(whole.substr(0, length)), "no error") << length;
  }
}

TEST(Gltf, AllComponentTypesAreRead) {
  GltfBuffer b;
  const auto read = [&](int index) {
    const auto data = open(gltf(b.embedded() + fmt::format(R"(,"x":{})", index)));
    const auto out = data->vectors<2>(data->root()["x"]);
    EXPECT_TRUE(data->status().ok()) << data->status();
    return out;
  };
  using V = std::vector<std::array<double, 2>>;
  const int i8 = b.add(packed<std::int8_t>({-128, 127, -127, 0}), "VEC2", 5120, 2);
  const int i8n = b.add(packed<std::int8_t>({-128, 127, -127, 0}), "VEC2", 5120, 2, R"(,"normalized":true)");
  const int u8n = b.add(packed<std::uint8_t>({0, 51, 102, 255}), "VEC2", 5121, 2, R"(,"normalized":true)");
  const int i16n = b.add(packed<std::int16_t>({-32768, 32767}), "VEC2", 5122, 1, R"(,"normalized":true)");
  const int u16n = b.add(packed<std::uint16_t>({65535, 13107}), "VEC2", 5123, 1, R"(,"normalized":true)");
  const int u32 = b.add(packed<std::uint32_t>({4294967295u, 7}), "VEC2", 5125, 1);
  const int f32 = b.add(packed<float>({0.5f, -1e30f}), "VEC2", 5126, 1);
  EXPECT_EQ(read(i8), (V{{-128, 127}, {-127, 0}}));
  EXPECT_EQ(read(i8n), (V{{-1, 1}, {-1, 0}}));
  EXPECT_EQ(read(u8n), (V{{0, 0.2}, {0.4, 1}}));
  EXPECT_EQ(read(i16n), (V{{-1, 1}}));
  EXPECT_EQ(read(u16n), (V{{1, 0.2}}));
  EXPECT_EQ(read(u32), (V{{4294967295.0, 7}}));
  EXPECT_EQ(read(f32), (V{{0.5, static_cast<double>(-1e30f)}}));
}

TEST(Gltf, ElementsMayBeInterleavedAndSparse) {
  // Two vectors of two floats with one float between. The sparse part replaces the second vector.
  const std::string bytes = packed<float>({1, 2, 99, 3, 4}) + packed<std::uint16_t>({1, 0}) + packed<float>({7, 8});
  const auto members = [&](const std::string& accessor) {
    return gltf(fmt::format(
        R"("buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}],
"bufferViews":[{{"buffer":0,"byteLength":20,"byteStride":12}},{{"buffer":0,"byteOffset":20,"byteLength":4}},
{{"buffer":0,"byteOffset":24,"byteLength":8}}],"accessors":[{}],"x":0)",
        bytes.size(), test::base64(bytes), accessor));
  };
  const std::string sparse =
      R"(,"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2}})";
  const auto read = [&](const std::string& accessor) {
    const auto data = open(members(accessor));
    const auto out = data->vectors<2>(data->root()["x"]);
    EXPECT_TRUE(data->status().ok()) << data->status();
    return out;
  };
  using V = std::vector<std::array<double, 2>>;
  const std::string strided = R"({"bufferView":0,"type":"VEC2","componentType":5126,"count":2)";
  EXPECT_EQ(read(strided + "}"), (V{{1, 2}, {3, 4}}));
  EXPECT_EQ(read(strided + sparse + "}"), (V{{1, 2}, {7, 8}}));
  EXPECT_EQ(read(R"({"type":"VEC2","componentType":5126,"count":3)" + sparse + "}"), (V{{0, 0}, {7, 8}, {0, 0}}));
  const auto error = [&](const std::string& accessor) {
    const auto data = open(members(accessor));
    EXPECT_TRUE(data->vectors<2>(data->root()["x"]).empty());
    return message_of(data->status());
  };
  EXPECT_EQ(error(R"({"bufferView":0,"type":"VEC2","componentType":5126,"count":3})"),
            "a.gltf: accessors[0]: 3 elements of 8 bytes from 0 on do not fit into the 20 bytes of its buffer view");
  EXPECT_EQ(error(R"({"bufferView":0,"type":"VEC2","componentType":5126,"count":2,"byteOffset":4})"),
            "a.gltf: accessors[0]: 2 elements of 8 bytes from 4 on do not fit into the 20 bytes of its buffer view");
  EXPECT_EQ(error(R"({"bufferView":0,"type":"VEC3","componentType":5126,"count":1})"),
            "a.gltf: accessors[0].type: VEC2 is expected here, got \"VEC3\"");
  EXPECT_EQ(error(R"({"bufferView":0,"type":"VEC2","componentType":5124,"count":1})"),
            "a.gltf: accessors[0].componentType: 5120, 5121, 5122, 5123, 5125 or 5126 is expected, got 5124");
  EXPECT_EQ(error(R"({"bufferView":9,"type":"VEC2","componentType":5126,"count":1})"),
            "a.gltf: accessors[0].bufferView: an index into the 3 bufferViews is expected, got 9");
  EXPECT_EQ(error(R"({"type":"VEC2","componentType":5126,"count":2000000000})"),
            "a.gltf: accessors[0].count: accessors without data have more than 4000000 elements");
  EXPECT_EQ(error(R"({"type":"VEC2","componentType":5126,"count":1)" + sparse + "}"),
            "a.gltf: accessors[0].sparse.indices: 1 is beyond the accessor's 1 elements");
  EXPECT_EQ(error(R"({"bufferView":0,"type":"VEC2","componentType":5126,"count":0})"),
            "a.gltf: accessors[0].count: a whole number from 1 to 2147483648 is expected, got 0");
}

TEST(Gltf, TrianglesStripsAndFansKeepTheirOrientation) {
  GltfBuffer b;
  const int square = b.positions(kSquarePositions);
  const int six = b.indices({0, 1, 2, 0, 2, 3});
  const int strip = b.indices({0, 1, 3, 2});
  const int fan = b.indices({0, 1, 2, 3});
  const auto mesh = [&](int mode, int indices) {
    return good_primitive(
        b, fmt::format(R"({{"attributes":{{"POSITION":{}}},"mode":{},"indices":{}}})", square, mode, indices));
  };
  EXPECT_EQ(mesh(4, six).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(mesh(4, six).normals.empty());
  // All of them face +z.
  for (const Mesh& m : {mesh(4, six), mesh(5, strip), mesh(6, fan)}) {
    ASSERT_EQ(m.triangles.size(), 2u);
    for (const auto& t : m.triangles) {
      const auto &p = m.positions[t[0]], &q = m.positions[t[1]], &r = m.positions[t[2]];
      EXPECT_EQ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]), 1);
    }
  }
  EXPECT_EQ(good_primitive(b, R"({"attributes":{"POSITION":0},"mode":6})").triangles,
            (Triangles{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
}

TEST(Gltf, NormalsHaveLengthOneAndTextureCoordinatesAreFlipped) {
  GltfBuffer b;
  b.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int normals = b.positions({0, 0, 2, 0, 0, 0, 0, 3, 4});
  const int uv = b.add(packed<std::uint8_t>({0, 0, 255, 51, 0, 255}), "VEC2", 5121, 3, R"(,"normalized":true)");
  std::string error;
  std::vector<std::string> notices;
  const auto mesh =
      primitive(b, fmt::format(R"({{"attributes":{{"POSITION":0,"NORMAL":{},"TEXCOORD_1":{}}}}})", normals, uv), error,
                notices, 1);
  ASSERT_TRUE(mesh.has_value()) << error;
  EXPECT_EQ(mesh->normals, (std::vector<std::array<float, 3>>{{0, 0, 1}, {0, 0, 1}, {0, 0.6f, 0.8f}}));
  EXPECT_EQ(mesh->texture_coordinates, (std::vector<std::array<float, 2>>{{0, 1}, {1, 0.8f}, {0, 0}}));
  EXPECT_EQ(notices, std::vector<std::string>{"a.gltf: meshes[0].primitives[0].attributes.NORMAL: 1 normal without a "
                                              "direction. The normals of the faces are used"});
}

TEST(Gltf, ColoursHaveAllFormsOfTheSpecification) {
  struct Case {
    std::string bytes, type;
    int component;
    std::string more;
    std::vector<std::array<float, 4>> expected;
    std::vector<std::string> notices = {};
  };
  const std::string normalized = R"(,"normalized":true)";
  for (
      const Case& c : std::vector<Case>{
          {packed<float>({1, 0, 0, 0.5f, 0.25f, 0, 0, 0, 1}),
           "VEC3",
           5126,
           "",
           {{1, 0, 0, 1}, {0.5f, 0.25f, 0, 1}, {0, 0, 1, 1}}},
          {packed<float>({1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 1, 1}),
           "VEC4",
           5126,
           "",
           {{1, 0, 0, 0}, {0, 1, 0, 0.5f}, {0, 0, 1, 1}}},
          {packed<std::uint8_t>({255, 0, 51, 0, 255, 0, 102, 0, 255}),
           "VEC3",
           5121,
           normalized,
           {{1, 0, 0.2f, 1}, {0, 1, 0, 1}, {0.4f, 0, 1, 1}}},
          {packed<std::uint8_t>({255, 0, 0, 51, 0, 255, 0, 102, 0, 0, 255, 255}),
           "VEC4",
           5121,
           normalized,
           {{1, 0, 0, 0.2f}, {0, 1, 0, 0.4f}, {0, 0, 1, 1}}},
          {packed<std::uint16_t>({65535, 0, 0, 13107, 0, 65535, 0, 26214, 0, 0, 65535, 65535}),
           "VEC4",
           5123,
           normalized,
           {{1, 0, 0, 0.2f}, {0, 1, 0, 0.4f}, {0, 0, 1, 1}}},
          {packed<float>({2, -1, 0, 0, 1, 0, 0, 0, 1}),
           "VEC3",
           5126,
           "",
           {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}},
           {"a.gltf: meshes[0].primitives[0].attributes.COLOR_0: colours from 0 to 1 are expected. Other values are cut"}}}) {
    GltfBuffer b;
    b.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const int colors = b.add(c.bytes, c.type, c.component, 3, c.more);
    std::string error;
    std::vector<std::string> notices;
    const auto mesh =
        primitive(b, fmt::format(R"({{"attributes":{{"POSITION":0,"COLOR_0":{}}}}})", colors), error, notices);
    ASSERT_TRUE(mesh.has_value()) << error;
    EXPECT_EQ(mesh->colors, c.expected) << c.type << c.component;
    EXPECT_EQ(notices, c.notices);
  }
}

TEST(Gltf, MeshOmissionsAreReportedOnce) {
  GltfBuffer b;
  b.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  std::string error;
  std::vector<std::string> notices;
  EXPECT_FALSE(primitive(b, R"({"attributes":{"POSITION":0},"mode":1})", error, notices).has_value());
  EXPECT_EQ(error, "no error");
  EXPECT_TRUE(primitive(b, R"({"attributes":{"POSITION":0,"COLOR_0":0,"COLOR_1":0,"JOINTS_0":0,"_ID":0},
"targets":[{"POSITION":0,"COLOR_0":0}]})",
                        error, notices)
                  .has_value());
  EXPECT_EQ(notices, (std::vector<std::string>{
                         "left out: points and lines", "left out: vertex colours beyond the first ones",
                         "left out: vertex attribute _ID",
                         "left out: morph targets of other attributes than positions, normals and tangents"}));
}

TEST(Gltf, WrongTrianglesAreSkippedAndNamed) {
  GltfBuffer b;
  b.positions(kSquarePositions);
  const int more = b.indices({0, 1, 2, 0, 5, 3, 9, 9, 9, 0, 2, 3, 1});
  std::string error;
  std::vector<std::string> notices;
  const auto mesh =
      primitive(b, fmt::format(R"({{"attributes":{{"POSITION":0}},"indices":{}}})", more), error, notices);
  ASSERT_TRUE(mesh.has_value()) << error;
  EXPECT_EQ(mesh->triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(notices,
            (std::vector<std::string>{
                "a.gltf: meshes[0].primitives[0]: 13 corners make no whole number of triangles. The last ones "
                "are skipped",
                "a.gltf: meshes[0].primitives[0].indices: vertex 5 is out of range, there are 5. The 2 triangles "
                "with such vertices are skipped"}));
}

// Each of many vertices without a normal gets that of a face, also beyond a thousand.
TEST(Gltf, AnyNumberOfNormalsMayBeMissing) {
  constexpr int kSide = 100;
  std::vector<float> positions, normals(3 * kSide * kSide);
  for (int i = 0; i < kSide * kSide; ++i) {
    const auto x = static_cast<float>(i % kSide), z = static_cast<float>(i / kSide);
    positions.insert(positions.end(), {x, 0, z});
  }
  std::vector<std::uint16_t> corners;
  for (int i = 0; i + kSide < kSide * kSide; ++i) {
    if (i % kSide != kSide - 1) {
      for (const int corner : {i, i + kSide, i + 1, i + 1, i + kSide, i + kSide + 1}) {
        corners.push_back(static_cast<std::uint16_t>(corner));
      }
    }
  }
  GltfBuffer b;
  b.positions(positions);
  b.positions(normals);
  b.indices(corners);
  const Mesh mesh = good_primitive(b, R"({"attributes":{"POSITION":0,"NORMAL":1},"indices":2})");
  EXPECT_EQ(mesh.normals, (std::vector<std::array<float, 3>>(kSide * kSide, {0, 1, 0})));
}

TEST(Gltf, LostGeometryIsAMistake) {
  GltfBuffer b;
  b.positions(kSquarePositions);
  b.positions({0, 0, 0, 1, 1, 1, 2, 2, 2});
  b.indices({0, 1, 2});
  const std::string at = "a.gltf: meshes[0].primitives[0]: ";
  EXPECT_EQ(bad_primitive(b, R"({"attributes":{"POSITION":1}})"), at + "none of its triangles has an area");
  EXPECT_EQ(bad_primitive(b, R"({"attributes":{"POSITION":1},"indices":2})"), at + "none of its triangles has an area");
  const auto error = [](const std::string& text) { return test::error_message(test::read(text)); };
  const auto of = [&](const std::string& accessor, const std::string& extensions) {
    std::string members = b.embedded();
    members.insert(members.rfind(']'), "," + accessor);
    return error(gltf(members +
                      R"(,"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":3},"indices":2)" +
                      extensions + "}]}]"));
  };
  const std::string empty = R"({"type":"VEC3","componentType":5126,"count":5})";
  EXPECT_EQ(of(empty, ""), at + "its positions are not in the file: accessors[3] has no bufferView");
  const std::string draco = R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":0}})";
  EXPECT_EQ(of(empty, draco),
            at + "its geometry is compressed (KHR_draco_mesh_compression), and there is none beside it: export it "
                 "without compression");
  // A file may have both forms.
  EXPECT_EQ(of(R"({"bufferView":0,"type":"VEC3","componentType":5126,"count":5})", draco), "no error");
  const auto meshopt = [&](const std::string& buffer) {
    return error(gltf(fmt::format(R"("buffers":[{}],"bufferViews":[{{"buffer":0,"byteLength":36,"extensions":{{
"KHR_meshopt_compression":{{"buffer":0}}}}}}],"accessors":[{{"bufferView":0,"type":"VEC3","componentType":5126,"count":3}}],
"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}])",
                                  buffer)));
  };
  EXPECT_EQ(meshopt(R"({"byteLength":36,"extensions":{"KHR_meshopt_compression":{"fallback":true}}})"),
            at + "its geometry is compressed (KHR_meshopt_compression), and there is none beside it: export it without "
                 "compression");
  EXPECT_EQ(meshopt(fmt::format(R"({{"byteLength":36,"uri":"data:;base64,{}"}})",
                                test::base64(packed<float>({0, 0, 0, 1, 0, 0, 0, 1, 0})))),
            "no error");
}

TEST(Gltf, MeshMistakesAreNamed) {
  GltfBuffer b;
  const int square = b.positions(kSquarePositions);
  const int wild = b.indices({0, 1, 5});
  const int two = b.indices({0, 1});
  const int wide = b.add(packed<float>({std::numeric_limits<float>::infinity(), 0, 0}), "VEC3", 5126, 1);
  const std::string at = "a.gltf: meshes[0].primitives[0]";
  EXPECT_EQ(bad_primitive(b, R"({"attributes":{}})"), at + ".attributes.POSITION: an accessor is expected");
  EXPECT_EQ(bad_primitive(b, R"({"attributes":{"POSITION":99}})"),
            at + ".attributes.POSITION: an index into the 4 accessors is expected, got 99");
  EXPECT_EQ(bad_primitive(b, R"({"attributes":{"POSITION":"x"}})"),
            at + ".attributes.POSITION: an index into the 4 accessors is expected, got \"x\"");
  EXPECT_EQ(bad_primitive(b, R"({"attributes":[]})"), at + ".attributes: an object is expected, got a list of 0");
  EXPECT_EQ(bad_primitive(b, R"({"attributes":{"POSITION":0},"mode":7})"),
            at + ".mode: a whole number from 0 to 6 is expected, got 7");
  EXPECT_EQ(bad_primitive(b, fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{}}})", square, wild)),
            at + ".indices: vertex 5 is out of range, there are 5");
  EXPECT_EQ(bad_primitive(b, fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{}}})", square, two)),
            at + ": 2 corners make no triangles");
  EXPECT_EQ(bad_primitive(b, fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":0}})", square)),
            "a.gltf: accessors[0].componentType: 5121, 5123 or 5125 is expected for indices, got 5126");
  EXPECT_EQ(bad_primitive(b, fmt::format(R"({{"attributes":{{"POSITION":{0},"NORMAL":{1}}},"mode":6}})", square, wide)),
            at + ".attributes.NORMAL: 5 normals are expected, got 1");
  EXPECT_EQ(bad_primitive(b, fmt::format(R"({{"attributes":{{"POSITION":{}}},"mode":6}})", wide)),
            at + ": 1 corners make no triangles");
}

}  // namespace
}  // namespace lightmill
