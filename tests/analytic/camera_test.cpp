// The camera, through public scene documents. A thin lens is sharp at its focus. Elsewhere it blurs an edge by the share of
// the lens that sees past the edge.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_document.h"

namespace lightmill::test {
namespace {

/// 16×16 pixels, a field of view of 53.13° (a film of 1 at distance 1), a lens focused at 4, and an emissive half plane
/// x > 0 at distance `depth`. `upper`: y > 0 instead.
HalfImages edge_at(double depth, double lens_radius, const std::string& shift = "", bool upper = false) {
  const std::string corners =
      upper ? fmt::format(R"("a": [1000, 0, {0}], "b": [0, 2000, {0}], "c": [-1000, 0, {0}])", -depth)
            : fmt::format(R"("a": [0, -1000, {0}], "b": [2000, 0, {0}], "c": [0, 1000, {0}])", -depth);
  const std::string text = fmt::format(R"({{
    "camera": {{"eye": [0, 0, 0], "look_at": [0, 0, -1], "camera_constant": 1, "lens_radius": {0}, "focus_distance": 4{2}}},
    "film": {{"width": 16, "height": 16, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
    "materials": [{{"name": "lamp", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}}, "emission": {{"rgb": [1, 1, 1]}}}}],
    "objects": [{{"material": "lamp", "triangle": {{{3}}}}}]}})",
                                       lens_radius, -depth, shift, corners);
  return TestScene::from_text(text).render({"path", 1, 0}, 10);
}

/// Mean over a column of pixels.
double column(const HalfImages& image, int x) {
  double sum = 0;
  for (int y = 0; y < 16; ++y) {
    sum += image.mean(static_cast<std::size_t>(3 * (16 * y + x)));
  }
  return sum / 16;
}

/// A ray from lens point l (in x) through the film at s (in film units; the plane of focus at 4s) reaches the edge's
/// plane at l(1 − d/4) + s·d. The answer is the share of the lens disc for which this is positive, averaged over the
/// pixel.
double exact_column(int x, double depth, double radius) {
  constexpr int kSteps = 2000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double s = (x + (i + 0.5) / kSteps) / 16 - 0.5;
    const double slope = 1 - depth / 4;
    const double t = std::clamp(-s * depth / (std::abs(slope) * radius), -1.0, 1.0);
    sum += 0.5 - (t * std::sqrt(1 - t * t) + std::asin(t)) / M_PI;
  }
  return sum / kSteps;
}

TEST(Shift, MovesThePictureByHeightsOfTheFilm) {
  constexpr double kRounding = 1e-3;        // of samples at the edge
  for (const double radius : {0.0, 0.5}) {  // a pinhole, and a lens that is in focus
    const HalfImages right = edge_at(4, radius, R"(, "shift_x": 0.25, "shift_y": -3)");
    EXPECT_NEAR(column(right, 3), 0, kRounding);
    EXPECT_NEAR(column(right, 4), 1, kRounding);
    const HalfImages left = edge_at(4, radius, R"(, "shift_x": -0.375)");
    EXPECT_NEAR(column(left, 13), 0, kRounding);
    EXPECT_NEAR(column(left, 14), 1, kRounding);
    const HalfImages up = edge_at(4, radius, R"(, "shift_y": 0.25)", true);
    EXPECT_NEAR(up.mean(3 * (16 * 11 + 5)), 1, kRounding);  // rows count from the top
    EXPECT_NEAR(up.mean(3 * (16 * 12 + 5)), 0, kRounding);
  }
}

TEST(ThinLens, IsSharpInThePlaneOfFocus) {
  const HalfImages image = edge_at(4, 0.5);
  EXPECT_EQ(column(image, 7), 0);
  EXPECT_EQ(column(image, 8), 1);
}

TEST(ThinLens, BlursByTheShareOfTheLensThatSeesPastTheEdge) {
  for (const double depth : {2.0, 10.0}) {
    for (const double radius : {0.1, 0.4}) {
      const HalfImages image = edge_at(depth, radius);
      for (int x = 0; x < 16; ++x) {
        // 16 · 1024 stratified samples per column.
        EXPECT_NEAR(column(image, x), exact_column(x, depth, radius), 2e-3) << depth << " " << radius << " " << x;
      }
    }
  }
}

TEST(ThinLens, IsAPinholeAtRadiusZero) {
  const HalfImages image = edge_at(2, 0);
  EXPECT_EQ(column(image, 7), 0);
  EXPECT_EQ(column(image, 8), 1);
}

}  // namespace
}  // namespace lightmill::test
