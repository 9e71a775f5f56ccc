// Shapes, instances and area lights of pbrt scenes.
#include "common/scene/mesh.h"
#include "tests/unit/scene_io/pbrt_fixture.h"

#include <cmath>
#include <numbers>

#include "common/math/vec.h"

namespace lightmill::test {
namespace {

using std::numbers::pi;

const std::string kSquare = R"("point3 P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] "integer indices" [0 1 2 0 2 3])";

/// Half the cross product of a triangle's edges, in the mesh's coordinates.
Vec3d area_normal(const Mesh& mesh, std::size_t triangle = 0) {
  const auto at = [&](std::size_t i) {
    const auto& p = mesh.positions[mesh.triangles[triangle][i]];
    return Vec3d(p[0], p[1], p[2]);
  };
  return 0.5 * glm::cross(at(1) - at(0), at(2) - at(0));
}

TEST(PbrtShapes, TrianglesKeepTheirCornersAndSides) {
  const Mesh square = object_mesh(world("Shape \"trianglemesh\" " + kSquare));
  EXPECT_EQ(square.positions.size(), 4u);
  EXPECT_EQ(square.triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_GT(area_normal(square).z, 0);
  EXPECT_LT(area_normal(object_mesh(world("ReverseOrientation Shape \"trianglemesh\" " + kSquare))).z, 0);
  // Shading normals decide the side, as in pbrt.
  const Mesh turned =
      object_mesh(world("Shape \"trianglemesh\" " + kSquare + "\"normal N\" [0 0 -2 0 0 -2 0 0 -2 0 0 -2]"));
  EXPECT_LT(area_normal(turned).z, 0);
  EXPECT_EQ(turned.normals[0], (std::array<float, 3>{0, 0, -1}));
  const Mesh both = object_mesh(
      world("ReverseOrientation Shape \"trianglemesh\" " + kSquare + "\"normal N\" [0 0 -2 0 0 -2 0 0 -2 0 0 -2]"));
  EXPECT_GT(area_normal(both).z, 0);
}

TEST(PbrtShapes, PatchesAndPlyMeshesAreMeshes) {
  const Mesh patch = object_mesh(world("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]"));
  ASSERT_EQ(patch.triangles.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(area_normal(patch, i).z, 0.5);
  }
  EXPECT_EQ(patch.texture_coordinates, (std::vector<std::array<float, 2>>{{0, 0}, {1, 0}, {0, 1}, {1, 1}}));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 0 1 2\n";
  EXPECT_EQ(area_normal(object_mesh(world("Shape \"plymesh\" \"string filename\" \"m.ply\"", {{"m.ply", ply}}))).z,
            0.5);
  EXPECT_EQ(pbrt_error("Shape \"plymesh\" \"string filename\" \"m.ply\"", {{"m.ply", "obj"}}),
            "a.pbrt:3: plymesh: m.ply: a PLY file begins with the line \"ply\"");
}

TEST(PbrtShapes, DisksAndSpheresFollowReverseOrientation) {
  const LoadedScene loaded = world(R"(Shape "disk" "float radius" 2 "float height" 3
Shape "cylinder" "float radius" 2 "float zmin" 1 "float zmax" 4 ReverseOrientation Shape "sphere")");
  ASSERT_EQ(loaded.scene.objects.size(), 3u);
  EXPECT_GT(area_normal(object_mesh(loaded, 0)).z, 0);
  EXPECT_EQ(loaded.scene.objects[0].transform, (Transform{{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 3}}}));
  EXPECT_EQ(loaded.scene.objects[1].transform, (Transform{{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 3, 1}}}));
  EXPECT_TRUE(std::get<SphereShape>(loaded.scene.objects[2].shape).normal_inward);
}

TEST(PbrtShapes, DistortedSpheresAreTriangles) {
  const LoadedScene loaded = world("Scale 1 2 3 Shape \"sphere\" \"float radius\" 2");
  EXPECT_EQ(loaded.scene.objects.at(0).transform, (Transform{{{2, 0, 0, 0}, {0, 4, 0, 0}, {0, 0, 6, 0}}}));
  EXPECT_EQ(loaded.notices, std::vector<std::string>{"shapes of the type \"sphere\" are rendered as triangles"});
}

constexpr const char* kOctahedron =
    R"("point3 P" [1 0 0 0 1 0 0 0 1 -1 0 0 0 -1 0 0 0 -1]
"integer indices" [0 1 2 1 3 2 3 4 2 4 0 2 1 0 5 3 1 5 4 3 5 0 4 5])";

TEST(PbrtShapes, SubdivisionReachesTheLimitSurface) {
  // Valence 4: a corner has the weight 1 − 4γ and its neighbours, whose sum is 0, γ = 1 / (4 + 3 / (8 · 3/32)) = 1/8.
  const Mesh corners = object_mesh(world(fmt::format("Shape \"loopsubdiv\" {} \"integer levels\" 0", kOctahedron)));
  EXPECT_NEAR(corners.positions[0][0], 0.5, 1e-12);
  const Mesh fine = object_mesh(world(fmt::format("Shape \"loopsubdiv\" {} \"integer levels\" 3", kOctahedron)));
  EXPECT_EQ(fine.triangles.size(), 8u * 64);
  for (std::size_t i = 0; i < 6; ++i) {  // points of the limit surface stay, however many levels follow
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(fine.positions[i][axis], corners.positions[i][axis], 1e-12);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {  // pbrt's normals are on the clockwise side, and decide that of the triangles
    EXPECT_NEAR(fine.normals[i][i], -1, 1e-6);
  }
  EXPECT_LT(area_normal(fine).x, 0);
}

TEST(PbrtShapes, SubdivisionKeepsBoundariesInTheirPlane) {
  const Mesh square = object_mesh(world("Shape \"loopsubdiv\" \"integer levels\" 2 " + kSquare));
  EXPECT_EQ(square.triangles.size(), 32u);
  // A corner has the weight 3/5, and both neighbours along the boundary 1/5. Before, two levels have moved the corner to
  // -11/16 and its neighbours to -3/8 and -7/8.
  const Mesh corner = object_mesh(world("Shape \"loopsubdiv\" \"integer levels\" 0 " + kSquare));
  EXPECT_NEAR(corner.positions[0][0], -0.6, 1e-12);
  EXPECT_NEAR(square.positions[0][0], -0.6625, 1e-12);
  for (std::size_t i = 0; i < square.positions.size(); ++i) {
    EXPECT_EQ(square.positions[i][2], 0);
    EXPECT_NEAR(square.normals[i][2], -1, 1e-6) << i;
  }
}

TEST(PbrtShapes, SubdivisionNeedsASurface) {
  const auto error = [](const std::string& rest) {
    return pbrt_error("Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] " + rest);
  };
  EXPECT_EQ(error("\"integer indices\" [0 1 2 0 1 3]"),
            "a.pbrt:3: loopsubdiv: the edge from vertex 0 to 1 belongs to two triangles of the same side");
  EXPECT_EQ(error("\"integer indices\" [0 1 1]"), "a.pbrt:3: loopsubdiv: a triangle has vertex 1 twice");
  EXPECT_EQ(error("\"integer indices\" [0 1 2 0 2 3] \"integer levels\" 12"),
            "a.pbrt:3: curved shapes make more than 200000000 triangles, or 20000000 different ones");
}

TEST(PbrtShapes, MistakesNameTheirLine) {
  EXPECT_EQ(pbrt_error("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]\n\"integer indices\" [0 1 3]"),
            "a.pbrt:4: Shape trianglemesh: integer indices: there is no vertex 3, there are 3");
  EXPECT_EQ(pbrt_error("Shape \"trianglemesh\" \"integer indices\" [0 1 2]"),
            "a.pbrt:3: Shape trianglemesh: P: positions are expected");
  EXPECT_EQ(pbrt_error("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1]"),
            "a.pbrt:3: Shape trianglemesh: point3 P: the number of values must be a multiple of 3, got 4");
  EXPECT_EQ(pbrt_error("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" [0 0]"),
            "a.pbrt:3: Shape trianglemesh: point2 uv: 3 values are expected, as of P");
  EXPECT_EQ(pbrt_error("Shape \"sphere\" \"float zmin\" 0.5 \"float zmax\" 0.5"),
            "a.pbrt:3: sphere: zmax must be above zmin");
  EXPECT_EQ(pbrt_error("Translate 1e20 0 0\nShape \"sphere\""),
            "a.pbrt:4: shape.sphere.center: coordinates must be finite and at most 1000000000000, got (1e+20, 0, 0)");
}

TEST(PbrtObjects, InstancesShareTheirMeshes) {
  const LoadedScene loaded = world(R"(ObjectBegin "o" Translate 1 0 0 Shape "trianglemesh" )" + kSquare +
                                   R"( Shape "sphere" ObjectEnd
AttributeBegin Scale 2 2 2 ObjectInstance "o" AttributeEnd
Translate 0 5 0 ObjectInstance "o")");
  ASSERT_EQ(loaded.scene.objects.size(), 4u);
  EXPECT_EQ(loaded.assets.size(), 1u);
  EXPECT_EQ(loaded.scene.objects[0].transform, (Transform{{{2, 0, 0, 2}, {0, 2, 0, 0}, {0, 0, 2, 0}}}));
  EXPECT_EQ(loaded.scene.objects[2].transform, (Transform{{{1, 0, 0, 1}, {0, 1, 0, 5}, {0, 0, 1, 0}}}));
  EXPECT_EQ(std::get<SphereShape>(loaded.scene.objects[1].shape).center, (Point3d{2, 0, 0}));
  EXPECT_EQ(std::get<SphereShape>(loaded.scene.objects[1].shape).radius, 2);
  EXPECT_EQ(pbrt_error("ObjectInstance \"x\""), "a.pbrt:3: ObjectInstance: there is no object \"x\"");
}

TEST(PbrtObjects, InstancesAreMirroredOnce) {
  const Result<LoadedScene> loaded = read_text(
      "WorldBegin ObjectBegin \"o\" Translate 1 0 0 Shape \"sphere\" ObjectEnd Translate 2 0 0 ObjectInstance \"o\"");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(std::get<SphereShape>(loaded->scene.objects.at(0).shape).center, (Point3d{-3, 0, 0}));
}

TEST(PbrtAreaLights, HaveTheirRadianceOrPower) {
  const auto emission = [](const std::string& light, const std::string& shape) {
    return world("AreaLightSource \"diffuse\" " + light + " Shape " + shape).scene.materials.at(0);
  };
  const std::string square = "\"trianglemesh\" " + kSquare;
  const Material plain = emission("\"rgb L\" [1 2 3] \"float scale\" 2 \"bool twosided\" true", square);
  EXPECT_EQ(plain.emission.rgb, (RgbColor{2, 4, 6}));
  EXPECT_TRUE(plain.two_sided_emission);
  // Each of the two triangles has an area of 2 and, in pbrt, all of the power: Φ = π A L.
  EXPECT_FLOAT_EQ(emission("\"float power\" 10", square).emission.rgb.r, static_cast<float>(10 / (2 * pi)));
  EXPECT_FLOAT_EQ(emission("\"float power\" 10 \"bool twosided\" true", square).emission.rgb.r,
                  static_cast<float>(10 / (4 * pi)));
  EXPECT_NEAR(emission("\"float power\" 10", "\"sphere\" \"float radius\" 2").emission.rgb.r, 10 / (pi * 16 * pi),
              1e-7);
  EXPECT_NEAR(emission("\"float power\" 10", "\"disk\" \"float radius\" 2").emission.rgb.r, 10 / (pi * 4 * pi), 1e-6);
  EXPECT_NEAR(emission("\"float power\" 10", "\"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 1 0 2 1 0]").emission.rgb.r,
              10 / (2 * pi), 1e-6);
}

TEST(PbrtAreaLights, TrianglesOfUnequalAreaHaveUnequalRadiance) {
  const LoadedScene loaded = world(R"(AreaLightSource "diffuse" "float power" 1
Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0 0 0 1 4 0 1 0 1 1] "integer indices" [0 1 2 3 4 5])");
  ASSERT_EQ(loaded.scene.objects.size(), 2u);
  EXPECT_NEAR(loaded.scene.materials[0].emission.rgb.r, 1 / (0.5 * pi), 1e-6);
  EXPECT_NEAR(loaded.scene.materials[1].emission.rgb.r, 1 / (2 * pi), 1e-6);
  EXPECT_EQ(object_mesh(loaded, 1).triangles.size(), 1u);
}

TEST(PbrtAreaLights, AlphaIsOpacity) {
  const Material half = world("Shape \"trianglemesh\" \"float alpha\" 0.5 " + kSquare).scene.materials.at(0);
  EXPECT_EQ(half.opacity.mode, Opacity::Mode::blend);
  EXPECT_EQ(half.opacity.value, 0.5);
}

}  // namespace
}  // namespace lightmill::test
