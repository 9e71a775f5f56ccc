// Planes, triangles, transforms and instances through public scene documents. Tests compare with exact answers, or
// compare two documents of the same scene.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_document.h"

namespace lightmill::test {
namespace {

/// 16×16 pixels of a floor seen straight down from (0, 2, 0), with −z up, and a point light of I = π at (0.3, 1, −0.2).
std::string floor_document(const std::string& objects) {
  return fmt::format(
      R"({{"camera": {{"eye": [0, 2, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "vertical_fov_degrees": 60}},
      "film": {{"width": 16, "height": 16, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "materials": [{{"name": "white", "diffuse": {{"reflectance": {{"rgb": [0.6, 0.6, 0.6]}}}}}}],
      "objects": [{}],
      "lights": [{{"point": {{"position": [0.3, 1, -0.2], "intensity": {{"rgb": [3.14159265, 3.14159265, 3.14159265]}}}}}}]}})",
      objects);
}

/// The mean of L = ρ/π · I cosθ / d² over each pixel, by the midpoint rule with 32² points.
double exact_floor(int x, int y) {
  const double half = 2 * std::tan(M_PI / 6);
  double sum = 0;
  for (int i = 0; i < 32; ++i) {
    for (int j = 0; j < 32; ++j) {
      const double px = half * ((x + (i + 0.5) / 32) / 8 - 1) - 0.3;
      const double pz = half * ((y + (j + 0.5) / 32) / 8 - 1) + 0.2;
      sum += 0.6 / std::pow(px * px + 1 + pz * pz, 1.5);
    }
  }
  return sum / (32 * 32);
}

void expect_floor(const std::string& objects) {
  const HalfImages image = TestScene::from_text(floor_document(objects)).render({"path", 3, 0}, 10);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const auto i = static_cast<std::size_t>(3 * (16 * y + x));
      // 1024 stratified points a pixel leave far less than 1e-3.
      EXPECT_NEAR(image.mean(i), exact_floor(x, y), 1e-3 * exact_floor(x, y)) << x << ", " << y;
    }
  }
}

TEST(Shapes, AnInfinitePlaneIsAFloor) {
  expect_floor(R"({"material": "white", "plane": {"point": [7, 0, 9], "normal": [0, 2, 0]}})");
}

TEST(Shapes, AMovedAndTurnedPlaneIsAFloor) {
  // The plane x = 1, turned by 90° about z and moved down by 1, is the floor.
  expect_floor(R"({"material": "white", "plane": {"point": [1, 0, 0], "normal": [1, 0, 0]},
      "transform": {"rotate": {"axis": [0, 0, 5], "degrees": 90}, "translate": [0, -1, 0]}})");
}

TEST(Shapes, AnUnevenlyScaledTriangleIsAFloor) {
  expect_floor(R"({"material": "white", "transform": {"scale": [0.0005, 1000, 0.0005]},
      "triangle": {"a": [-40000, 0, 42000], "b": [80000, 0, 44000], "c": [1000, 0, -100000]}})");
}

TEST(Shapes, ALargeTriangleIsAFloor) {
  expect_floor(R"({"material": "white", "triangle": {"a": [-20, 0, 21], "b": [40, 0, 22], "c": [0.5, 0, -50]}})");
}

TEST(Shapes, AMirroredTriangleKeepsItsOuterSide) {
  // A one-sided emitter, mirrored in x. It must still be visible from above.
  const std::string text =
      R"({"camera": {"eye": [0, 2, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "vertical_fov_degrees": 20},
      "film": {"width": 4, "height": 4},
      "materials": [{"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [5, 5, 5]}}],
      "objects": [{"material": "lamp", "triangle": {"a": [-9, 0, 9], "b": [9, 0, 9], "c": [0, 0, -9]},
                   "transform": {"scale": [-1, 1, 1]}}]})";
  EXPECT_EQ(mean_of(TestScene::from_text(text).render({"path", 1, 0}, 1), 0).value, 5);
}

/// An open bowl with vertex normals. It has enough triangles that two copies become instances, and differs from its
/// mirror image.
std::string bowl(const std::function<std::array<double, 3>(std::array<double, 3>)>& map, bool mirrored) {
  constexpr int kRings = 12, kSegments = 24;
  std::string text, faces;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int segment = 0; segment <= kSegments; ++segment) {
      const double theta = M_PI / 2 * ring / kRings, phi = 2 * M_PI * segment / kSegments;
      const double r = 1 + 0.3 * std::sin(3 * phi + 1) * std::sin(theta);
      const auto p =
          map({r * std::sin(theta) * std::cos(phi), -r * std::cos(theta), r * std::sin(theta) * std::sin(phi)});
      text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
    }
  }
  for (int ring = 0; ring < kRings; ++ring) {
    for (int segment = 0; segment < kSegments; ++segment) {
      const int a = ring * (kSegments + 1) + segment + 1, b = a + kSegments + 1;
      faces += mirrored ? fmt::format("f {} {} {}\nf {} {} {}\n", a, b, a + 1, b, b + 1, a + 1)
                        : fmt::format("f {} {} {}\nf {} {} {}\n", a, a + 1, b, b, a + 1, b + 1);
    }
  }
  return text + faces;
}

std::string bowls_document(const std::string& objects) {
  return fmt::format(R"({{"camera": {{"eye": [0, 4, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 50}},
      "film": {{"width": 48, "height": 48, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "materials": [{{"name": "white", "diffuse": {{"reflectance": {{"rgb": [0.8, 0.6, 0.4]}}}}}}],
      "objects": [{}, {{"material": "white", "plane": {{"point": [0, -2, 0], "normal": [0, 1, 0]}}}}],
      "lights": [{{"point": {{"position": [2, 5, 3], "intensity": {{"rgb": [60, 60, 60]}}}}}}]}})",
                     objects);
}

TEST(Shapes, InstancesLookLikeCopiesOfTheirMesh) {
  const auto same = [](std::array<double, 3> p) { return p; };
  // Scaled by (2, 1, 0.5), turned by 90° about y (x → −z, z → x), and moved.
  const auto first = [](std::array<double, 3> p) {
    return std::array<double, 3>{0.5 * p[2] - 1.5, p[1], -2 * p[0] + 0.5};
  };
  const auto second = [](std::array<double, 3> p) { return std::array<double, 3>{-p[0] + 1.5, p[1] + 0.3, p[2]}; };
  const HalfImages instanced = TestScene::from_text(bowls_document(R"(
          {"material": "white", "mesh": {"file": "bowl.obj"}, "transform":
            {"scale": [2, 1, 0.5], "rotate": {"axis": [0, 1, 0], "degrees": 90}, "translate": [-1.5, 0, 0.5]}},
          {"material": "white", "mesh": {"file": "bowl.obj"}, "transform":
            {"matrix": [-1, 0, 0, 1.5, 0, 1, 0, 0.3, 0, 0, 1, 0, 0, 0, 0, 1]}})"),
                                                    {{"bowl.obj", bowl(same, false)}})
                                   .render({"path", 5, 0}, 4);
  const HalfImages copied = TestScene::from_text(bowls_document(R"({"material": "white", "mesh": {"file": "a.obj"}},
                                             {"material": "white", "mesh": {"file": "b.obj"}})"),
                                                 {{"a.obj", bowl(first, false)}, {"b.obj", bowl(second, true)}})
                                .render({"path", 5, 0}, 4);
  // The same random numbers on the same surfaces. Only rounding differs, and it affects few paths.
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < copied.a.size(); ++i) {
    difference += std::abs(copied.mean(i) - instanced.mean(i));
    sum += copied.mean(i);
  }
  EXPECT_GT(sum / static_cast<double>(copied.a.size()), 0.05);
  EXPECT_LT(difference, 2e-3 * sum);
}

TEST(Shapes, ATransformedSphereEqualsTheSphereGivenDirectly) {
  const auto document = [](const std::string& sphere) {
    return R"({"camera": {"eye": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov_degrees": 40},
      "film": {"width": 32, "height": 32},
      "materials": [{"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [1, 1, 1]}},
                    {"name": "white", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}}],
      "objects": [{"material": "white", "plane": {"point": [0, -2, 0], "normal": [0, 1, 0]}}, )" +
           sphere + "]}";
  };
  const HalfImages moved =
      TestScene::from_text(document(R"({"material": "lamp", "sphere": {"center": [1, 0, 0], "radius": 0.5},
          "transform": {"scale": [2, 2, 2], "rotate": {"axis": [0, 0, 1], "degrees": 90}, "translate": [1, -1, 0]}})"))
          .render({"path", 1, 0}, 4);
  const HalfImages direct =
      TestScene::from_text(document(R"({"material": "lamp", "sphere": {"center": [1, 1, 0], "radius": 1}})"))
          .render({"path", 1, 0}, 4);
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < direct.a.size(); ++i) {
    difference += std::abs(direct.mean(i) - moved.mean(i));
    sum += direct.mean(i);
  }
  EXPECT_LT(difference, 1e-3 * sum);
}

}  // namespace
}  // namespace lightmill::test
