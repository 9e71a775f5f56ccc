#include "common/scene_io/obj.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill {
namespace {

std::string obj_error(const std::string& text) {
  const Result<ObjFile> file = read_obj(text, "box.obj");
  return file.ok() ? "no error" : message_of(file.status());
}

Mesh mesh_of(const std::string& text) {
  const Result<ObjFile> file = read_obj(text, "box.obj");
  EXPECT_TRUE(file.ok()) << file.status();
  std::vector<const ObjPart*> parts;
  for (const ObjPart& part : file->parts) {
    parts.push_back(&part);
  }
  const Mesh mesh = make_mesh(*file, parts);
  EXPECT_TRUE(validate(mesh).ok()) << validate(mesh);
  return mesh;
}

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, PolygonsAreCutIntoFans) {
  const Mesh mesh = mesh_of(kSquare + "v -1 0.5 0\nf 1 2 3 4 5\n");
  EXPECT_EQ(mesh.positions.size(), 5u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
  EXPECT_TRUE(mesh.normals.empty());
}

TEST(Obj, CornersHaveFourForms) {
  for (const std::string face : {"f 1 2 3", "f 1/1 2/1 3/1", "f 1//1 2//1 3//1", "f 1/1/1 2/1/1 3/1/1"}) {
    const Mesh mesh = mesh_of(kSquare + "vt 0 0\nvn 0 0 2\n" + face);
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}})) << face;
    EXPECT_EQ(mesh.positions.size(), 3u) << face;
    EXPECT_EQ(mesh.normals.size(),
              face.find("1 2//1") != std::string::npos || face.find("/1/1") != std::string::npos ? 3u : 0u)
        << face;
  }
}

TEST(Obj, NegativeIndicesCountBackwards) {
  const Mesh mesh = mesh_of(kSquare + "f -4 -3 -2\nv 5 5 5\nf -1 -5 -4\n");
  EXPECT_EQ(mesh.positions.back(), (std::array<double, 3>{5, 5, 5}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {3, 0, 1}}));
}

TEST(Obj, WhitespaceCommentsAndContinuationsAreUnderstood) {
  const Mesh mesh = mesh_of(
      "# a comment\r\n\r\nv 0 0 0 # origin\r\nv\t1 0 0 1.0\r\nv 1 1 \\\r\n 0\r\n  v +0 1e0 -0 0.5 0.5 0.5\r\nf 1 2 "
      "\\\n 3 \\\n 4");
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.positions[2], (std::array<double, 3>{1, 1, 0}));
  EXPECT_EQ(mesh.triangles.size(), 2u);
}

TEST(Obj, FacesOfOneMaterialFormOnePart) {
  const Result<ObjFile> file = read_obj(kSquare +
                                            "mtllib a.mtl\no thing\ng one two\ns off\nusemtl red\nf 1 2 3\nusemtl pale "
                                            "blue\nf 1 3 4\nusemtl red\nf 2 3 4\nusemtl unused\n",
                                        "x.obj");
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_EQ(file->parts.size(), 2u);
  EXPECT_EQ(file->parts[0].material, "red");
  EXPECT_EQ(file->parts[0].line, 9);
  EXPECT_EQ(file->parts[0].triangles.size(), 2u);
  EXPECT_EQ(file->parts[1].material, "pale blue");
  ASSERT_EQ(file->libraries.size(), 1u);
  EXPECT_EQ(file->libraries[0].file, "a.mtl");
  EXPECT_EQ(file->libraries[0].line, 5);
  const ObjPart* second = &file->parts[1];
  const Mesh mesh = make_mesh(*file, std::span(&second, 1));
  EXPECT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
}

TEST(Obj, SmoothMeshesHaveUnitNormalsEverywhere) {
  const Mesh mesh = mesh_of(kSquare + "vn 0 3 4\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1 3 4\nf 1//2 2//2 3//2\n");
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  EXPECT_EQ(mesh.normals[0], (std::array<float, 3>{0, 0.6f, 0.8f}));
  EXPECT_EQ(mesh.normals[mesh.triangles[1][0]], (std::array<float, 3>{0, 0, 1}));
  EXPECT_EQ(mesh.normals[mesh.triangles[2][0]], (std::array<float, 3>{0, 0, 1}));
}

TEST(Obj, ConcavePolygonsAreCovered) {
  // The dart's fan from its first corner would leave it.
  const std::string dart = "v 4 0 0\nv 1 1 0\nv 0 4 0\nv 0 0 0\n";
  EXPECT_EQ(mesh_of(dart + "f 1 2 3 4\n").triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  const Result<ObjFile> crossing = read_obj("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\nf 4 3 2 1\n", "box.obj");
  ASSERT_TRUE(crossing.ok()) << crossing.status();
  EXPECT_EQ(crossing->notices,
            std::vector<std::string>{"polygons of box.obj cross themselves, and were cut into fans"});
}

using Uv = std::array<float, 2>;

TEST(Obj, TextureCoordinatesBelongToVertices) {
  const Mesh mesh = mesh_of(kSquare + "vt 0.25 0.5 9\nvt -1.5\nvt 1e9 2\nf 1/1 2/2 3/-1\nf 1/1 3/2 4\n");
  // Corner 3 has two coordinates, so two vertices; a corner without any has (0, 0).
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 3, 4}}));
  EXPECT_EQ(mesh.texture_coordinates, (std::vector<Uv>{{0.25f, 0.5f}, {-1.5f, 0}, {1e9f, 2}, {-1.5f, 0}, {0, 0}}));
  EXPECT_EQ(mesh.positions[2], mesh.positions[3]);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh_of(kSquare + "vt 0 0\nf 1 2 3\n").texture_coordinates.empty());
}

/// Two squares of a roof whose ridge lies along z; the left one falls to −x, the right one to +x.
const std::string kRoof = "v -1 0 0\nv -1 0 1\nv 0 1 0\nv 0 1 1\nv 1 0 0\nv 1 0 1\n";

TEST(Obj, SmoothingGroupsMakeNormals) {
  const float s = std::sqrt(0.5f);
  Mesh mesh = mesh_of(kRoof + "s 1\nf 1 2 4 3\nf 3 4 6 5\n");
  ASSERT_EQ(mesh.positions.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const auto& p = mesh.positions[i];
    const auto& n = mesh.normals[i];
    const float side = static_cast<float>(p[0]);  // −1, 0 (the ridge) or 1
    EXPECT_NEAR(n[0], side * s, 1e-6f);
    EXPECT_NEAR(n[1], side == 0 ? 1 : s, 1e-6f);
    EXPECT_NEAR(n[2], 0, 1e-6f);
  }
  // Two groups do not mix, and faces in none stay flat.
  for (const char* groups : {"s 1\nf 1 2 4 3\ns 2\nf 3 4 6 5\n", "s 7\nf 1 2 4 3\ns off\nf 3 4 6 5\n",
                             "s 1\nf 1 2 4 3\ns 0\nusemtl x\nf 3 4 6 5\n"}) {
    mesh = mesh_of(kRoof + groups);
    for (const auto& n : mesh.normals) {
      EXPECT_NEAR(std::abs(n[0]), s, 1e-6f) << groups;
    }
  }
  EXPECT_TRUE(mesh_of(kRoof + "f 1 2 4 3\n").normals.empty());
  // A group continues after another one, and across materials.
  mesh = mesh_of(kRoof + "s 1\nf 1 2 4 3\ns 2\nf 1 2 3\ns 1\nusemtl x\nf 3 4 6 5\n");
  EXPECT_NEAR(mesh.normals[mesh.triangles.back()[0]][1], 1, 1e-6f);
}

TEST(Obj, SmoothNormalsAreWeightedByAngle) {
  // Three faces meet at a cube's corner in right angles: (1, 1, 1) / √3. One face has two triangles there, and one face
  // is ten times as large. Neither changes the normal.
  const Mesh mesh = mesh_of(
      "v 0 0 0\nv -1 0 0\nv 0 -1 0\nv 0 0 -10\nv -1 -1 0\nv -1 0 -10\nv 0 -1 -10\ns 4\n"
      "f 1 2 5 3\nf 1 4 6 2\nf 1 3 7 4\n");
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (mesh.positions[i] == std::array<double, 3>{0, 0, 0}) {
      for (const float n : mesh.normals[i]) {
        EXPECT_NEAR(n, 1 / std::sqrt(3.0f), 1e-6f);
      }
    }
  }
}

TEST(Obj, GivenNormalsOverrideSmoothingGroups) {
  const Mesh mesh = mesh_of(kRoof + "vn 0 0 1\ns 1\nf 1//1 2//1 4//1 3\nf 3 4 6 5\n");
  EXPECT_EQ(mesh.normals[0], (std::array<float, 3>{0, 0, 1}));
  EXPECT_EQ(mesh.normals[2], (std::array<float, 3>{0, 0, 1}));
  EXPECT_NEAR(mesh.normals[mesh.triangles[1][2]][1], 1, 1e-6f);  // corner 3 has none: from the group
}

TEST(Obj, FacesBackToBackHaveNoMeanNormal) {
  const Mesh mesh = mesh_of(kSquare + "s 1\nf 1 2 3\nf 3 2 1\nf 1 1 1\n");
  EXPECT_TRUE(mesh.normals.empty());  // nothing to smooth is left, so it stays flat
}

TEST(Obj, AMillionTrianglesShareTheirVertices) {
  // 708×708 points of a flat field, a vertex for each, with faces in any order.
  constexpr int kSide = 708;
  std::string text;
  for (int i = 0; i < kSide * kSide; ++i) {
    text += fmt::format("v {} 0 {}\n", i % kSide, i / kSide);
  }
  for (int i = 0; i < (kSide - 1) * (kSide - 1); ++i) {
    const int a = i / (kSide - 1) * kSide + i % (kSide - 1) + 1;
    text += fmt::format("f {} {} {} {}\n", a, a + 1, a + 1 + kSide, a + kSide);
  }
  const Mesh mesh = mesh_of(text);
  EXPECT_EQ(mesh.triangles.size(), 999'698u);
  EXPECT_EQ(mesh.positions.size(), 501'264u);
}

TEST(Obj, MistakesAreReportedWithTheirPlace) {
  EXPECT_EQ(obj_error(kSquare), "box.obj: the mesh is empty, at least one face (f) is expected");
  EXPECT_EQ(obj_error(""), "box.obj: the mesh is empty, at least one face (f) is expected");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 5"), "box.obj:5: f: index 5 is out of range, there are 4 vertices so far");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 -5"), "box.obj:5: f: index -5 is out of range, there are 4 vertices so far");
  EXPECT_EQ(obj_error(kSquare + "f 0 1 2"), "box.obj:5: f: index 0 is out of range, there are 4 vertices so far");
  EXPECT_EQ(obj_error(kSquare + "f 1//1 2//1 3//1"),
            "box.obj:5: f: index 1 is out of range, there are 0 normals so far");
  EXPECT_EQ(obj_error(kSquare + "f 1 2"), "box.obj:5: f: at least 3 corners are expected, got 2");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 x"), "box.obj:5: f: an index is expected, got \"x\"");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 3.5"), "box.obj:5: f: an index is expected, got \"3.5\"");
  EXPECT_EQ(obj_error(kSquare + "f 1/ 2/ 3/"), "box.obj:5: f: v, v/t, v//n or v/t/n is expected, got \"1/\"");
  EXPECT_EQ(obj_error(kSquare + "f 1/a/1 2 3"), "box.obj:5: f: an index is expected, got \"a\"");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 99999999999999999999"),
            "box.obj:5: f: an index is expected, got \"99999999999999999999\"");
  EXPECT_EQ(obj_error("v 1 2"), "box.obj:1: v: three numbers are expected, got 2");
  const std::string digits(std::size_t{2} << 20, '7');
  for (const char* before : {"v 1 ", "v 1 2 3 4 x", "vt x", "s x"}) {
    const std::string message = obj_error(before + digits + "x");
    EXPECT_LT(message.size(), 400u) << before;
    EXPECT_TRUE(message.starts_with("box.obj:1: ") && message.ends_with("777…")) << message;
  }
  EXPECT_EQ(obj_error("v 1 nan 2"), "box.obj:1: v: a finite number is expected, got \"nan\"");
  EXPECT_EQ(obj_error("v 1 inf 2"), "box.obj:1: v: a finite number is expected, got \"inf\"");
  EXPECT_EQ(obj_error("v 1 1e999 2"), "box.obj:1: v: a finite number is expected, got \"1e999\"");
  EXPECT_EQ(obj_error("v 1 2 1e13"), "box.obj:1: v: numbers of at most 1000000000000 are expected, got 1e13");
  EXPECT_EQ(obj_error("\n\nvn 1 2 three"), "box.obj:3: vn: a finite number is expected, got \"three\"");
  EXPECT_EQ(obj_error(kSquare + "vt 0 0\nf 1/1 2/2 3/1"),
            "box.obj:6: f: index 2 is out of range, there are 1 texture coordinates so far");
  EXPECT_EQ(obj_error("vt"), "box.obj:1: vt: a number is expected");
  EXPECT_EQ(obj_error("vt 0 nan"), "box.obj:1: vt: a finite number is expected, got \"nan\"");
  EXPECT_EQ(obj_error("vt 0 1e10"), "box.obj:1: vt: numbers of at most 1000000000 are expected, got 1e10");
  EXPECT_EQ(obj_error("s x"), "box.obj:1: s: the number of a smoothing group or off is expected, got \"x\"");
  EXPECT_EQ(obj_error("s -1"), "box.obj:1: s: the number of a smoothing group or off is expected, got \"-1\"");
  EXPECT_EQ(obj_error("usemtl"), "box.obj:1: usemtl: the name of a material is expected");
  EXPECT_EQ(obj_error("v 0 0 0\nvertex 1 2 3"),
            "box.obj:2: unknown statement \"vertex\"; v, vt, vn, f, o, g, s, usemtl or mtllib is expected");
}

TEST(Obj, OmissionsAreReportedOnce) {
  const Result<ObjFile> file = read_obj(kSquare + "l 1 2\nl 2 3\np 1\nf 1 2 3\n", "box.obj");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->notices, (std::vector<std::string>{"left out: \"l\" statements of box.obj",
                                                     "left out: \"p\" statements of box.obj"}));
}

}  // namespace
}  // namespace lightmill
