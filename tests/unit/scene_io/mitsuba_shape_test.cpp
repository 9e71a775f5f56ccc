// Shapes and instances of Mitsuba scenes.
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "common/scene/mesh.h"
#include "tests/unit/scene_io/mitsuba_fixture.h"

namespace lightmill::test {
namespace {

using std::numbers::pi;

constexpr const char* kChecked = R"(<bsdf type="diffuse"><texture name="reflectance" type="checkerboard"/></bsdf>)";

std::string shape(const std::string& type, const std::string& parameters = "") {
  return "<shape type=\"" + type + "\">" + parameters + "</shape>";
}

Mesh mesh_of_shape(const std::string& type, const std::string& parameters = "", const TextFiles& files = {}) {
  return object_mesh(mitsuba_scene(shape(type, parameters), files));
}

struct Sums {
  std::array<double, 3> area_vector{};  ///< of all triangles
  double area = 0, volume = 0;          ///< the volume is positive if they face outwards
};

Sums sums_of(const Mesh& mesh, const Transform& map = kIdentityTransform) {
  const auto at = [&](std::uint32_t i) {
    const auto& p = mesh.positions[i];
    std::array<double, 3> out{};
    for (std::size_t k = 0; k < 3; ++k) {
      out[k] = map[k][0] * p[0] + map[k][1] * p[1] + map[k][2] * p[2] + map[k][3];
    }
    return out;
  };
  Sums out;
  for (const auto& t : mesh.triangles) {
    const auto a = at(t[0]), b = at(t[1]), c = at(t[2]);
    const std::array<double, 3> u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const std::array<double, 3> n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    for (std::size_t k = 0; k < 3; ++k) {
      out.area_vector[k] += n[k] / 2;
      out.volume += n[k] * a[k] / 6;
    }
    out.area += std::hypot(n[0], n[1], n[2]) / 2;
  }
  return out;
}

TEST(MitsubaShapes, RectangleFacesUpItsZ) {
  expect_near(sums_of(mesh_of_shape("rectangle")).area_vector, {0, 0, 4});
  expect_near(sums_of(mesh_of_shape("rectangle", R"(<boolean name="flip_normals" value="true"/>)")).area_vector,
              {0, 0, -4});
}

// Mitsuba's (u, v) = (0, 0) is at (-1, -1), and shows the upper left texel. That is (0, 1) in a document.
TEST(MitsubaShapes, TheTopOfAnImageIsAtTheRectanglesMinimumY) {
  const Mesh mesh = mesh_of_shape("rectangle");
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_EQ(mesh.texture_coordinates[i][0], (mesh.positions[i][0] + 1) / 2);
    EXPECT_EQ(mesh.texture_coordinates[i][1], (1 - mesh.positions[i][1]) / 2);
  }
}

TEST(MitsubaShapes, CubeIsClosedAndFacesOutwards) {
  const Sums sums = sums_of(mesh_of_shape("cube"));
  EXPECT_NEAR(sums.volume, 8, 1e-12);
  EXPECT_NEAR(sums.area, 24, 1e-12);
  expect_near(sums.area_vector, {0, 0, 0});
}

TEST(MitsubaShapes, CurvedShapesHaveTheirAreas) {
  EXPECT_NEAR(sums_of(mesh_of_shape("disk")).area_vector[2], pi, 1e-9);
  const LoadedScene tube = mitsuba_scene(shape("cylinder", R"(<point name="p0" value="1, 0, 0"/>
<point name="p1" value="1, 3, 4"/><float name="radius" value="0.5"/>)"));
  const Sums sums = sums_of(object_mesh(tube), tube.scene.objects[0].transform);
  EXPECT_NEAR(sums.area, 2 * pi * 0.5 * 5, 1e-9);
  EXPECT_GT(sums.volume, 0);
  EXPECT_EQ(mitsuba_error("\n" + shape("cylinder", R"(<point name="p1" value="0"/>)")),
            "a.xml:3: shape cylinder: point p1: must differ from p0");
}

// A disk's u is the radius. Its v goes around, from the top of the image.
TEST(MitsubaShapes, DiskHasMitsubasCoordinates) {
  const Mesh mesh = mesh_of_shape("disk", kChecked);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto& p = mesh.positions[i];
    const auto& [u, v] = mesh.texture_coordinates[i];
    EXPECT_NEAR(u, std::hypot(p[0], p[1]), 1e-3);
    if (u > 0.5 && v > 0.01f && v < 0.99f) {
      const double angle = std::atan2(p[1], p[0]);
      EXPECT_NEAR(1 - v, (angle < 0 ? angle + 2 * pi : angle) / (2 * pi), 1e-6);
    }
  }
}

TEST(MitsubaShapes, TexturedSpheresAreTriangles) {
  const LoadedScene loaded = mitsuba_scene(shape("sphere", kChecked));
  const Mesh mesh = object_mesh(loaded);
  EXPECT_GT(sums_of(mesh).volume, 4.18);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    // v is 0 at +z in Mitsuba.
    EXPECT_NEAR(mesh.texture_coordinates[i][1], 1 - std::acos(std::clamp(mesh.positions[i][2], -1.0, 1.0)) / pi, 1e-4);
  }
}

TEST(MitsubaShapes, SpheresFaceInwardsIfFlipped) {
  const auto loaded = mitsuba_scene(shape("sphere", R"(<boolean name="flip_normals" value="true"/>)"));
  EXPECT_TRUE(std::get<SphereShape>(loaded.scene.objects[0].shape).normal_inward);
}

const TextFiles kMeshes{
    {"roof.obj",
     "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 -1\nv 1 0 -1\nvt 0 0.25\nf 1/1 2/1 3/1\nf 1/1 5/1 2/1\nf 1/1 4/1 5/1\n"},
    {"leaf.ply",
     "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float u\n"
     "property float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
     "0 0 0 0 0.25\n1 0 0 0 0.25\n0 1 0 0 0.25\n3 0 1 2\n"}};

std::string mesh_file(const std::string& name, const std::string& parameters = "") {
  return "<string name=\"filename\" value=\"" + name + "\"/>" + parameters;
}

// Mitsuba's v goes down the image. OBJ files are turned unless flip_tex_coords is off, PLY files if it is on.
TEST(MitsubaShapes, TextureCoordinatesOfFilesAreFlippedAsStated) {
  const std::string on = R"(<boolean name="flip_tex_coords" value="true"/>)",
                    off = R"(<boolean name="flip_tex_coords" value="false"/>)";
  EXPECT_EQ(mesh_of_shape("obj", mesh_file("roof.obj"), kMeshes).texture_coordinates[0][1], 0.25f);
  EXPECT_EQ(mesh_of_shape("obj", mesh_file("roof.obj", off), kMeshes).texture_coordinates[0][1], 0.75f);
  EXPECT_EQ(mesh_of_shape("ply", mesh_file("leaf.ply"), kMeshes).texture_coordinates[0][1], 0.75f);
  EXPECT_EQ(mesh_of_shape("ply", mesh_file("leaf.ply", on), kMeshes).texture_coordinates[0][1], 0.25f);
}

// Faces of +z and -y meet at the edge from (0, 0, 0) to (1, 0, 0). Normals are weighted by the angles of their faces.
TEST(MitsubaShapes, MeshesWithoutNormalsGetSmoothOnes) {
  const Mesh smooth = mesh_of_shape("obj", mesh_file("roof.obj"), kMeshes);
  ASSERT_EQ(smooth.normals.size(), smooth.positions.size());
  // At (0, 0, 0) the +z face has 45°, and those of -y 90° in all.
  for (std::size_t i = 0; i < smooth.positions.size(); ++i) {
    if (smooth.positions[i] == std::array<double, 3>{0, 0, 0}) {
      EXPECT_NEAR(smooth.normals[i][1], -2 / std::sqrt(5), 1e-6);
      EXPECT_NEAR(smooth.normals[i][2], 1 / std::sqrt(5), 1e-6);
    }
  }
  EXPECT_TRUE(mesh_of_shape("obj", mesh_file("roof.obj", R"(<boolean name="face_normals" value="true"/>)"), kMeshes)
                  .normals.empty());
  const Mesh leaf = mesh_of_shape("ply", mesh_file("leaf.ply"), kMeshes);
  ASSERT_EQ(leaf.normals.size(), 3u);
  EXPECT_EQ(leaf.normals[0], (std::array<float, 3>{0, 0, 1}));
}

TEST(MitsubaShapes, NormalMapsGetTheDirectionOfU) {
  const Mesh mesh = object_mesh(mitsuba_scene(
      shape("rectangle",
            R"(<bsdf type="normalmap"><texture name="normalmap" type="bitmap"><string name="filename" value="a.png"/>
<boolean name="raw" value="true"/></texture><bsdf type="diffuse"/></bsdf>)"),
      {{"a.png", "picture"}}));
  ASSERT_EQ(mesh.tangents.size(), 4u);
  EXPECT_EQ(mesh.tangents[0], (std::array<float, 4>{1, 0, 0, 1}));
}

template <class T>
void put(const T& value, std::string& out) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// A triangle in the plane z = `height`, whose corners have v = 1/4.
std::string packed_triangle(double height, bool doubles) {
  std::string plain;
  put(static_cast<std::uint32_t>(2 | (doubles ? 0x2000 : 0x1000)), plain);
  plain.append("name").push_back('\0');
  put(std::uint64_t{3}, plain);
  put(std::uint64_t{1}, plain);
  for (const double value : {0.0, 0.0, height, 1.0, 0.0, height, 0.0, 1.0, height, 0.0, 0.25, 1.0, 0.25, 0.0, 0.25}) {
    if (doubles) {
      put(value, plain);
    } else {
      put(static_cast<float>(value), plain);
    }
  }
  for (const std::uint32_t corner : {0u, 1u, 2u}) {
    put(corner, plain);
  }
  std::string packed(compressBound(plain.size()), '\0');
  uLongf size = packed.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
                     plain.size()),
            Z_OK);
  std::string out;
  put(std::uint16_t{0x041c}, out);
  put(std::uint16_t{4}, out);
  return out + packed.substr(0, size);
}

std::string two_triangles() {
  std::string out = packed_triangle(1, false);
  const std::uint64_t second = out.size();
  out += packed_triangle(2, true);
  put(std::uint64_t{0}, out);
  put(second, out);
  put(std::uint32_t{2}, out);
  return out;
}

TEST(MitsubaSerialized, MeshesAreUnpacked) {
  for (const int index : {0, 1}) {
    const Mesh mesh =
        mesh_of_shape("serialized", mesh_file("m", fmt::format(R"(<integer name="shape_index" value="{}"/>)", index)),
                      {{"m", two_triangles()}});
    ASSERT_EQ(mesh.positions.size(), 3u);
    EXPECT_EQ(mesh.positions[1], (std::array<double, 3>{1, 0, index + 1.0}));
    EXPECT_EQ(mesh.texture_coordinates[0], (std::array<float, 2>{0, 0.75f}));
    EXPECT_EQ(mesh.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
  }
}

TEST(MitsubaSerialized, DamagedFilesAreRefused) {
  const std::string whole = two_triangles();
  const auto error_of = [](const std::string& bytes, int index) {
    return mitsuba_error(
        shape("serialized", mesh_file("m", fmt::format(R"(<integer name="shape_index" value="{}"/>)", index))),
        {{"m", bytes}});
  };
  EXPECT_EQ(error_of("", 0), "a.xml:2: shape serialized: m: a serialized mesh of version 3 or 4 is expected");
  EXPECT_EQ(error_of(whole, 2), "a.xml:2: shape serialized: m: there is no mesh 2");
  EXPECT_EQ(error_of(whole.substr(0, 8), 0), "a.xml:2: shape serialized: m: mesh 0 cannot be unpacked");
  EXPECT_TRUE(error_of(whole.substr(0, 30), 0).starts_with("a.xml:2: shape serialized: m: mesh 0 "));
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
    error_of(damaged, 1);  // may be read, but must not crash
  }
}

TEST(MitsubaInstances, ShareTheMeshesOfTheirGroup) {
  const LoadedScene loaded = mitsuba_scene(R"(<shape type="shapegroup" id="g"><shape type="cube">
<transform name="to_world"><translate x="1"/></transform></shape><shape type="sphere"/></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><scale value="2"/></transform></shape>
<shape type="instance"><ref id="g"/></shape>)");
  ASSERT_EQ(loaded.scene.objects.size(), 4u);
  EXPECT_EQ(loaded.assets.size(), 1u);
  EXPECT_EQ(loaded.scene.objects[0].transform[0], (std::array<double, 4>{2, 0, 0, 2}));
  EXPECT_EQ(std::get<SphereShape>(loaded.scene.objects[1].shape).radius, 2);
  EXPECT_EQ(loaded.scene.objects[2].transform[0], (std::array<double, 4>{1, 0, 0, 1}));
  EXPECT_EQ(mitsuba_error("<shape type=\"instance\"/>"), "a.xml:2: shape instance: one shapegroup is expected");
  EXPECT_EQ(
      mitsuba_error("<shape type=\"shapegroup\">\n<shape type=\"cube\">\n<emitter type=\"area\"/></shape></shape>"),
      "a.xml:4: a shapegroup cannot have emitters");
}

}  // namespace
}  // namespace lightmill::test
