#include "common/scene_io/obj.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/error_message.h"

namespace lightmill {
namespace {

Result<ObjFile> obj_of(const std::string& text, std::vector<std::string>* notices = nullptr) {
  Faults faults;
  Result<ObjFile> file = read_obj(text, "box.obj", faults);
  if (notices != nullptr) {
    *notices = faults.notices();
  }
  return file;
}

std::string obj_error(const std::string& text) {
  return test::error_message(obj_of(text));
}

Mesh mesh_of(const std::string& text, std::vector<std::string>* notices = nullptr) {
  const Result<ObjFile> file = obj_of(text, notices);
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

using Colors = std::vector<std::array<float, 4>>;

TEST(Obj, ColoursOfVerticesAreDecoded) {
  const auto linear = [](double encoded) { return static_cast<float>(std::pow((encoded + 0.055) / 1.055, 2.4)); };
  struct Case {
    std::array<std::string, 3> colors;  // after the coordinates
    Colors expected;
    std::vector<std::string> notices = {};
  };
  for (const Case& c :
       std::vector<Case>{{{"", "", ""}, {}},
                         {{"1", "0.5", "2"}, {}},  // weights
                         {{"0.5 0.5", "x", "1 2 z"}, {}},
                         {{"1 0 0", "0 1 0", "0 0 1"}, {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}}},
                         {{"0.5 1 0", "0 0 0", "1 1 1"}, {{linear(0.5), 1, 0, 1}, {0, 0, 0, 1}, {1, 1, 1, 1}}},
                         {{"1 0 0 1", "0 1 0 1", "0 0 1 1"}, {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}}},
                         {{"255 0 0", "0 51 0", "0 0 1"},
                          {{1, 0, 0, 1}, {0, linear(0.2), 0, 1}, {0, 0, static_cast<float>(1 / 255.0 / 12.92), 1}}},
                         {{"", "0 1 0", ""}, {{1, 1, 1, 1}, {0, 1, 0, 1}, {1, 1, 1, 1}}},  // the others are white
                         {{"1.5 0 0", "0 0.5 0", "0 0 1"},
                          {{1, 0, 0, 1}, {0, linear(0.5), 0, 1}, {0, 0, 1, 1}},
                          {"vertex colours of box.obj that are above 1 were cut"}},
                         {{"1 0 0 0.5", "0 1 0 1", "0 0 1 1"},
                          {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}},
                          {"left out: alpha of vertex colours of box.obj"}}}) {
    const std::string text =
        fmt::format("v 0 0 0 {}\nv 1 0 0 {}\nv 0 1 0 {}\nf 1 2 3\n", c.colors[0], c.colors[1], c.colors[2]);
    const Result<ObjFile> file = obj_of(text);
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_EQ(file->notices, c.notices) << text;
    const Mesh mesh = mesh_of(text);
    ASSERT_EQ(mesh.colors.size(), c.expected.size()) << text;
    for (std::size_t i = 0; i < mesh.colors.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(mesh.colors[i][k], c.expected[i][k], 1e-6f) << text;
      }
    }
  }
  const Result<ObjFile> painted = obj_of("v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ff808080ff808080\nf 1 2 3\n");
  ASSERT_TRUE(painted.ok());
  EXPECT_EQ(painted->notices, std::vector<std::string>{"left out: vertex colours in \"#MRGB\" comments of box.obj"});
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
  const Result<ObjFile> file = obj_of(kSquare +
                                      "mtllib a.mtl\no thing\ng one two\ns off\nusemtl red\nf 1 2 3\nusemtl pale "
                                      "blue\nf 1 3 4\nusemtl red\nf 2 3 4\nusemtl unused\n");
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
  const Result<ObjFile> crossing = obj_of("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\nf 4 3 2 1\n");
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

TEST(Obj, ManyTrianglesShareTheirVertices) {
  // 300×300 points of a flat field, a vertex for each: more than 16 bits can number.
  constexpr int kSide = 300;
  std::string text;
  for (int i = 0; i < kSide * kSide; ++i) {
    text += fmt::format("v {} 0 {}\n", i % kSide, i / kSide);
  }
  for (int i = 0; i < (kSide - 1) * (kSide - 1); ++i) {
    const int a = i / (kSide - 1) * kSide + i % (kSide - 1) + 1;
    text += fmt::format("f {} {} {} {}\n", a, a + 1, a + 1 + kSide, a + kSide);
  }
  const Mesh mesh = mesh_of(text);
  EXPECT_EQ(mesh.triangles.size(), 178'802u);
  EXPECT_EQ(mesh.positions.size(), 90'000u);
}

TEST(Faults, OnlyTheFirstOfEachKindNeedsItsText) {
  Faults faults;
  EXPECT_TRUE(faults.needs_text("a"));
  faults.add("a", "file:1: a", "b");
  EXPECT_FALSE(faults.needs_text("a"));
  for (std::size_t i = 1; i < Faults::kMaxKinds; ++i) {
    EXPECT_TRUE(faults.needs_text("another"));
    faults.add(fmt::format("kind {}", i), "file:2: c", "d");
  }
  EXPECT_FALSE(faults.needs_text("another"));
}

using Texts = std::vector<std::string>;

TEST(Obj, FilesWithoutAFaceAreMistakes) {
  EXPECT_EQ(obj_error(kSquare), "box.obj: the mesh is empty, at least one face (f) is expected");
  EXPECT_EQ(obj_error(""), "box.obj: the mesh is empty, at least one face (f) is expected");
  EXPECT_EQ(obj_error(kSquare + "f 1 2\nf 1 2 9\n"), "box.obj:5: f: at least 3 corners are expected, got 2");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 2\n\nf 1 1 1 1\n"), "box.obj:5: f: this face and all others have no area");
  EXPECT_EQ(obj_error(kSquare + "f 1 2 2\nf 1 2 3\n"), "no error");
}

/// The notices of a file with a good square after the statements.
Texts faults_of(const std::string& statements) {
  Texts notices;
  const Mesh mesh = mesh_of(statements + "\n" + kSquare + "f -4 -3 -2 -1", &notices);
  EXPECT_EQ(mesh.triangles.size(), 2u) << statements;
  return notices;
}

TEST(Obj, WrongStatementsAreSkippedAndNamedWithTheirPlace) {
  const auto fault = [](const std::string& statements) {
    const Texts all = faults_of(statements);
    EXPECT_EQ(all.size(), 1u) << statements;
    return all.empty() ? "" : all[0];
  };
  EXPECT_EQ(
      fault("vertex 1 2 3"),
      "box.obj:1: unknown statement \"vertex\". Known statements: v, vt, vn, f, o, g, s, usemtl, mtllib. The line is "
      "skipped");
  EXPECT_EQ(fault("\n\nf 1 2 x"), "box.obj:3: f: an index is expected, got \"x\". The face is skipped");
  EXPECT_EQ(fault("f 1 2 \xe9\x1b"), "box.obj:1: f: an index is expected, got \"\\xe9\\x1b\". The face is skipped");
  EXPECT_EQ(fault("f 0 1 2"),
            "box.obj:1: f: index 0 is out of range, there are 0 vertices so far. The face is skipped");
  EXPECT_EQ(fault("f 1 2 -5"),
            "box.obj:1: f: index -5 is out of range, there are 0 vertices so far. The face is skipped");
  EXPECT_EQ(fault("f 1 2 5"), "box.obj:1: f: index 5 is out of range, there are 4 vertices. The face is skipped");
  EXPECT_EQ(fault("f 1 2 99999999999999999999"),
            "box.obj:1: f: an index is expected, got \"99999999999999999999\". The face is skipped");
  EXPECT_EQ(fault("f 1 2\nf 3\nf"),
            "box.obj:1: f: at least 3 corners are expected, got 2. The face is skipped (and 2 more like it)");
  EXPECT_EQ(fault("v 1 2"), "box.obj:1: v: three numbers are expected, got 2. The faces there are skipped");
  EXPECT_EQ(fault("v 1 nan 2"), "box.obj:1: v: a finite number is expected, got \"nan\". The faces there are skipped");
  EXPECT_EQ(fault("v 1 1e999 2"),
            "box.obj:1: v: a finite number is expected, got \"1e999\". The faces there are skipped");
  EXPECT_EQ(fault("v 1 2 1e13"),
            "box.obj:1: v: numbers of at most 1000000000000 are expected, got 1e13. The faces there are skipped");
  EXPECT_EQ(fault("vn 1 2 three"), "box.obj:1: vn: a finite number is expected, got \"three\". It is ignored");
  EXPECT_EQ(fault("vn 0 0 0"), "box.obj:1: vn: a direction is expected, got (0, 0, 0). It is ignored");
  EXPECT_EQ(fault("vt"), "box.obj:1: vt: a number is expected. The coordinates count as (0, 0)");
  EXPECT_EQ(fault("vt 0 1e10"),
            "box.obj:1: vt: numbers of at most 1000000000 are expected, got 1e10. The coordinates count as (0, 0)");
  EXPECT_EQ(fault("s x"),
            "box.obj:1: s: the number of a smoothing group or off is expected, got \"x\". The line is skipped");
  EXPECT_EQ(fault("mtllib"), "box.obj:1: mtllib: a file name is expected. The line is skipped");
  EXPECT_EQ(fault("usemtl"),
            "box.obj:1: usemtl: the name of a material is expected. The faces are rendered as grey diffuse");
}

TEST(Obj, FaultsOfAKindAreOneNotice) {
  std::string text;
  for (int i = 0; i < 1000; ++i) {
    text += fmt::format("odd{} 1\nf 1 2 x\n", i);
  }
  const Texts all = faults_of(text);
  ASSERT_EQ(all.size(), Faults::kMaxKinds + 1);
  EXPECT_EQ(all[1], "box.obj:2: f: an index is expected, got \"x\". The face is skipped (and 999 more like it)");
  EXPECT_EQ(all.back(), "901 faults of other kinds are not listed");  // 1000 statements and the faces are 1001 kinds
  const std::string digits(std::size_t{2} << 20, '7');
  for (const char* before : {"v 1 ", "vt x", "s x", ""}) {
    const Texts cut = faults_of(before + digits + "x");
    ASSERT_EQ(cut.size(), 1u);
    EXPECT_LT(cut[0].size(), 500u) << before;
  }
}

TEST(Obj, FacesOfUnreadableVerticesAreSkipped) {
  Texts notices;
  const Mesh mesh = mesh_of("v 0 0 0\nv 1 #IND 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n", &notices);
  EXPECT_EQ(mesh.positions, (std::vector<std::array<double, 3>>{{0, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(notices, (Texts{"box.obj:2: v: three numbers are expected, got 1. The faces there are skipped",
                            "box.obj:5: f: vertex 2 cannot be read. The face is skipped"}));
}

TEST(Obj, EmptyAndWrongIndicesOfACornerAreIgnored) {
  for (const std::string face : {"f 1/ 2/ 3/", "f 1// 2// 3//", "f 1/0 2/0 3/0", "f 1/a 2/a 3/a", "f 1/7 2/7 3/7",
                                 "f 1/-7 2/-7 3/-7", "f 1//7 2//7 3//7", "f 1/7/7 2/7/7 3/7/7"}) {
    Texts notices;
    const Mesh mesh = mesh_of(kSquare + "vt 1 1\nvn 0 0 1\n" + face, &notices);
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}})) << face;
    EXPECT_TRUE(mesh.normals.empty() && mesh.texture_coordinates.empty()) << face;
    ASSERT_EQ(notices.size(), 1u) << face;
    EXPECT_TRUE(notices[0].starts_with("box.obj:7: f: ")) << notices[0];
    EXPECT_NE(notices[0].find(". The index is ignored (and "), std::string::npos) << notices[0];
  }
  Texts notices;
  const Mesh mesh = mesh_of(kSquare + "vt 0.5 1\nf 1/1/ 2/1/ 3/1/\n", &notices);
  EXPECT_EQ(mesh.texture_coordinates, std::vector<Uv>(3, Uv{0.5f, 1}));
  EXPECT_EQ(notices, Texts{"box.obj:6: f: v, v/t, v//n or v/t/n is expected, got \"1/1/\". The index is ignored "
                           "(and 2 more like it)"});
}

// Each kind of index may name what the file defines later, beside indices that count from the end.
TEST(Obj, FacesMayReferToLaterEntries) {
  Texts notices;
  Mesh mesh = mesh_of(kSquare + "vt 0.25 1\nf 1/1/1 2/-1/1 -2/1/1 4/2/1\nvn 0 0 3\nvt 0.5 1\n", &notices);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.normals, (std::vector<std::array<float, 3>>(4, {0, 0, 1})));
  EXPECT_EQ(mesh.texture_coordinates, (std::vector<Uv>{{0.25f, 1}, {0.25f, 1}, {0.25f, 1}, {0.5f, 1}}));
  EXPECT_TRUE(notices.empty());
  // The faces have the material and the smoothing group of their place.
  const std::string faces = "usemtl a\ns 1\nf 1 2 4 3\nusemtl b\ns 1\nf 3 4 6 5\ns off\nusemtl a\nf 1 2 3\n";
  const Result<ObjFile> late = obj_of(faces + kRoof), early = obj_of(kRoof + faces);
  ASSERT_TRUE(late.ok() && early.ok()) << late.status();
  ASSERT_EQ(late->parts.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const ObjPart *const a = &late->parts[i], *const b = &early->parts[i];
    EXPECT_EQ(a->material, b->material);
    EXPECT_EQ(encode_mesh(make_mesh(*late, std::span(&a, 1))), encode_mesh(make_mesh(*early, std::span(&b, 1))));
  }
}

TEST(Obj, LinesEndWithAnyMixtureOfCrAndLf) {
  const std::string lines = kSquare + "# a comment\nf 1 2 3 \\\n 4\nodd\n";
  Texts expected;
  const Mesh mesh = mesh_of(lines, &expected);
  ASSERT_EQ(expected.size(), 1u);
  EXPECT_TRUE(expected[0].starts_with("box.obj:8: ")) << expected[0];
  for (const std::string_view end : {"\r", "\r\n"}) {
    for (const std::size_t from : {std::size_t{0}, std::size_t{10}}) {  // all lines, or those after the first
      std::string text = lines.substr(0, from);
      for (const char c : lines.substr(from)) {
        text += c == '\n' ? end : std::string_view(&c, 1);
      }
      Texts notices;
      EXPECT_EQ(encode_mesh(mesh_of(text, &notices)), encode_mesh(mesh));
      EXPECT_EQ(notices, expected);
    }
  }
}

TEST(Obj, OmissionsAreReportedOnce) {
  const Result<ObjFile> file = obj_of(kSquare + "l 1 2\nl 2 3\np 1\nf 1 2 3\n");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->notices, (std::vector<std::string>{"left out: \"l\" statements of box.obj",
                                                     "left out: \"p\" statements of box.obj"}));
}

}  // namespace
}  // namespace lightmill
