#include "common/scene/compiled/mesh_parts.h"

#include <gtest/gtest.h>

namespace lightmill::test {
namespace {

using Positions = std::vector<std::array<float, 3>>;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// A tetrahedron.
const Positions kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const Triangles kFaces{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

TEST(MeshParts, AClosedSurfaceIsOnePart) {
  const MeshParts parts = find_parts(kCorners, kFaces);
  EXPECT_EQ(parts.of_triangle, (std::vector<std::uint32_t>{0, 0, 0, 0}));
  EXPECT_EQ(parts.flipped, (std::vector<bool>{false, false, false, false}));
  EXPECT_EQ(parts.closed, std::vector<bool>{true});
}

TEST(MeshParts, FindsFlippedTriangles) {
  Triangles faces = kFaces;
  std::swap(faces[1][0], faces[1][1]);
  std::swap(faces[3][1], faces[3][2]);
  const MeshParts parts = find_parts(kCorners, faces);
  EXPECT_EQ(parts.flipped, (std::vector<bool>{false, true, false, true}));
  EXPECT_EQ(parts.closed, std::vector<bool>{true});
}

TEST(MeshParts, AMissingFaceOpensThePart) {
  const MeshParts parts = find_parts(kCorners, {kFaces.begin(), kFaces.end() - 1});
  EXPECT_EQ(parts.of_triangle, (std::vector<std::uint32_t>{0, 0, 0}));
  EXPECT_EQ(parts.closed, std::vector<bool>{false});
}

TEST(MeshParts, CornersWithEqualPositionsAreMerged) {
  Positions positions;
  Triangles faces;
  for (const auto& face : kFaces) {  // as a file with flat normals has them
    for (const std::uint32_t corner : face) {
      positions.push_back(kCorners[corner]);
    }
    const auto last = static_cast<std::uint32_t>(positions.size());
    faces.push_back({last - 3, last - 2, last - 1});
  }
  positions.push_back({-0.0f, 0, 0});
  faces[0][0] = 12;
  const MeshParts parts = find_parts(positions, faces);
  EXPECT_EQ(parts.of_triangle, (std::vector<std::uint32_t>{0, 0, 0, 0}));
  EXPECT_EQ(parts.closed, std::vector<bool>{true});
}

TEST(MeshParts, RepeatedAndEmptyTrianglesDoNotOpenAPart) {
  Triangles faces = kFaces;
  faces.push_back({1, 0, 2});
  faces.push_back({1, 1, 3});
  const MeshParts parts = find_parts(kCorners, faces);
  EXPECT_EQ(parts.of_triangle, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 2}));
  EXPECT_EQ(parts.closed, (std::vector<bool>{true, false, false}));
}

TEST(MeshParts, ThreeTrianglesAtOneEdgeAreThreeParts) {
  const Positions positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, -1}};
  const MeshParts parts = find_parts(positions, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
  EXPECT_EQ(parts.of_triangle, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(MeshParts, OneSidedSurfacesAreOpen) {
  // A Möbius strip of five triangles, and the projective plane of six points. The plane has no free edge either.
  const Positions positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, 0, 1}};
  EXPECT_EQ(find_parts(positions, {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}, {3, 4, 0}, {4, 0, 1}}).closed,
            std::vector<bool>{false});
  const MeshParts plane = find_parts(
      positions,
      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1}, {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}});
  EXPECT_EQ(plane.closed, std::vector<bool>{false});
}

}  // namespace
}  // namespace lightmill::test
