// Virtual meters of scene documents, and comparison of their readings with exact answers.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/meter_reading.h"
#include "tests/support/render_document.h"

namespace lightmill::test {

/// Reads all meters of a document by a method, with 2^level samples per pixel of each of their tiles.
inline std::vector<MeterReading> read_meters(const TestScene& scene, std::uint32_t level, std::uint64_t seed = 1,
                                             const CompiledScene::ImageDecoder& images = nullptr,
                                             const std::string& name = "path", std::uint32_t max_bounces = 0) {
  const auto compiled = CompiledScene::compile(scene.scene(), scene.assets(), images);
  EXPECT_TRUE(compiled.ok()) << message_of(compiled.status());
  const auto method = make_method(*compiled, {name, seed, max_bounces});
  EXPECT_TRUE(method.ok()) << message_of(method.status());
  const auto workspace = (*method)->make_workspace();
  std::vector<MeterReading> readings;
  for (std::uint32_t i = 0; i < scene.scene().meters.size(); ++i) {
    const Node node = (*method)->render(meter_rect(i), {level, 0}, *workspace);
    EXPECT_EQ(node.non_finite, 0u);
    readings.push_back(read_meter(scene.scene().meters[i], node.values, 3, std::uint64_t{1} << level));
  }
  return readings;
}

/// A document for meters, with a camera that sees nothing. `parts` are its materials, objects, lights and meters.
inline TestScene scene_with(const std::string& parts, const std::map<std::string, std::string>& files = {},
                            const CompiledScene::ImageDecoder& images = nullptr) {
  return TestScene::from_text(
      R"({"camera": {"eye": [0, 0, 50], "look_at": [0, 0, 0], "vertical_fov_degrees": 10}, )" + parts + "}", files,
      images);
}

/// The value lies within its own interval, widened to 4.5 standard errors (false alarm 7e-6 each). The interval is at
/// most `precision` of the value. 1e-5 of the value is for rounding.
inline void expect_reading(const MeterReading& reading, double expected, double precision) {
  EXPECT_NEAR(reading.value, expected, 4.5 / 1.96 * reading.half_width + 1e-5 * expected);
  EXPECT_LE(4.5 / 1.96 * reading.half_width, precision * expected) << "the noise hides a difference";
  EXPECT_NEAR(reading.photometric, 683 * reading.value, 1e-9 * reading.photometric);
  EXPECT_NEAR(reading.photometric_width, 683 * reading.half_width, 1e-9 * reading.photometric);
}

/// The sum of several independent readings.
inline MeterReading sum_of(const std::vector<MeterReading>& readings) {
  MeterReading sum;
  double squares = 0;
  for (const MeterReading& reading : readings) {
    sum.value += reading.value;
    squares += reading.half_width * reading.half_width;
  }
  sum.half_width = std::sqrt(squares);
  sum.photometric = 683 * sum.value;
  sum.photometric_width = 683 * sum.half_width;
  return sum;
}

/// Form factor of equal parallel rectangles a × b at distance h (Siegel & Howell, C-11).
inline double parallel_form_factor(double a, double b, double h) {
  const double x = a / h, y = b / h, x1 = 1 + x * x, y1 = 1 + y * y;
  return 2 / (kPiDouble * x * y) *
         (std::log(std::sqrt(x1 * y1 / (1 + x * x + y * y))) + x * std::sqrt(y1) * std::atan(x / std::sqrt(y1)) +
          y * std::sqrt(x1) * std::atan(y / std::sqrt(x1)) - x * std::atan(x) - y * std::atan(y));
}

}  // namespace lightmill::test
