// Pieces of scene documents, and comparison with exact answers.
//
// Each estimate must lie within 5 of its standard errors of the exact value (a false alarm once in 1.7 million). The
// standard error must be small enough for the comparison to mean something.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/render_document.h"

namespace lightmill::test {

/// Share of an answer by which rounding (float32 coordinates, offsets from surfaces) may shift it.
inline constexpr double kRounding = 2e-5;

inline void expect_answer(const Estimate& estimate, double exact, double max_relative_error) {
  EXPECT_LT(estimate.standard_error, max_relative_error * exact) << "too much noise to compare";
  EXPECT_NEAR(estimate.value, exact, 5 * estimate.standard_error + kRounding * exact)
      << "standard error " << estimate.standard_error;
}

/// A document with a small square film; `view` is the camera without its field of view.
inline std::string document(const std::string& view, double fov_degrees, int size, const std::string& materials,
                            const std::string& objects, const std::string& lights = "") {
  return fmt::format(R"({{"camera": {{{}, "vertical_fov_degrees": {}}},
      "film": {{"width": {}, "height": {}, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "materials": [{}], "objects": [{}], "lights": [{}]}})",
                     view, fov_degrees, size, size, materials, objects, lights);
}

/// Another entry of a list.
inline std::string also(const std::string& entry) {
  return fmt::format(", {}", entry);
}
inline std::string gray(double value) {
  return fmt::format(R"({{"rgb": [{0}, {0}, {0}]}})", value);
}
inline std::string diffuse(const std::string& name, double reflectance, double emission = 0) {
  return fmt::format(R"({{"name": "{}", "diffuse": {{"reflectance": {}}}, "emission": {}}})", name, gray(reflectance),
                     gray(emission));
}
/// A material. `kind` is the field that names its type.
inline std::string named(const std::string& name, const std::string& kind, double emission = 0) {
  return fmt::format(R"({{"name": "{}", {}, "emission": {}}})", name, kind, gray(emission));
}
/// An object. `kind` is the field that names its shape.
inline std::string shape(const std::string& material, const std::string& kind, const std::string& transform = "") {
  return fmt::format(R"({{"material": "{}", {}{}}})", material, kind,
                     transform.empty() ? "" : fmt::format(R"(, "transform": {})", transform));
}
inline std::string plane_shape(const std::string& material, const std::string& point, const std::string& normal) {
  return shape(material, fmt::format(R"("plane": {{"point": {}, "normal": {}}})", point, normal));
}
inline std::string sphere(const std::string& material, const std::string& center, double radius, bool inward = false) {
  return fmt::format(
      R"({{"name": "{0} sphere", "material": "{0}", "sphere": {{"center": {1}, "radius": {2}, "normal_inward": {3}}}}})",
      material, center, radius, inward);
}
inline std::string mesh(const std::string& material, const std::string& file) {
  return fmt::format(R"({{"name": "{1}", "material": "{0}", "mesh": {{"file": "{1}"}}}})", material, file);
}
/// An OBJ file with one polygon.
inline std::string polygon(const std::vector<std::array<double, 3>>& corners) {
  std::string text, face = "f";
  for (std::size_t i = 0; i < corners.size(); ++i) {
    text += fmt::format("v {} {} {}\n", corners[i][0], corners[i][1], corners[i][2]);
    face += fmt::format(" {}", i + 1);
  }
  return text + face + "\n";
}
/// The rectangle [x0, x1] × [z0, z1] in the plane y = height, facing up or down.
inline std::string horizontal_rectangle(double x0, double x1, double z0, double z1, double height, bool up) {
  return up ? polygon({{x0, height, z0}, {x0, height, z1}, {x1, height, z1}, {x1, height, z0}})
            : polygon({{x0, height, z0}, {x1, height, z0}, {x1, height, z1}, {x0, height, z1}});
}
/// A closed box, facing outwards.
inline std::string box(double x0, double x1, double y0, double y1, double z0, double z1) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0);
  }
  return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}
/// A square around (0, height, 0).
inline std::string horizontal_square(double side, double height, bool up) {
  return horizontal_rectangle(-side / 2, side / 2, -side / 2, side / 2, height, up);
}
/// A square that reaches far beyond the view. Its diagonal stays away from the middle, because fast rays can slip
/// through where two triangles meet.
inline std::string plane(double side, double height, bool up) {
  return horizontal_rectangle(-0.4 * side, 0.6 * side, -0.55 * side, 0.45 * side, height, up);
}

inline const char* const kInside = R"("eye": [0.1, 0.2, 0.3], "look_at": [1, 0.3, 0.2])";

/// The red of each pixel in the middle row (`along_x`) or column.
inline std::vector<double> line_of(const HalfImages& image, bool along_x) {
  std::vector<double> out;
  for (int i = 0; i < (along_x ? image.width : image.height); ++i) {
    const int pixel = along_x ? image.height / 2 * image.width + i : i * image.width + image.width / 2;
    out.push_back(image.mean(static_cast<std::size_t>(3 * pixel)));
  }
  return out;
}

/// Zeros, and ones at [begin, end).
inline std::vector<double> lit_from(int begin, int end, int size) {
  std::vector<double> out(static_cast<std::size_t>(size), 0.0);
  std::fill(out.begin() + begin, out.begin() + end, 1.0);
  return out;
}

}  // namespace lightmill::test
