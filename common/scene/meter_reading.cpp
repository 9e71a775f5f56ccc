#include "common/scene/meter_reading.h"

#include <array>
#include <cmath>
#include <numeric>

#include "common/base/check.h"
#include "common/film/tile_grid.h"
#include "common/lights/photometry.h"

namespace lightmill {
namespace {

/// Quantile of Student's distribution with kTileSize - 1 degrees of freedom.
constexpr double kStudent95 = 1.998340542520741;

/// Area of a flux meter in square scene units. 1 for other meters.
double scale_of(const Meter& meter) {
  if (!std::holds_alternative<FluxMeter>(meter.kind)) {
    return 1;
  }
  const Point3d& a = patch_of(meter)->edge1;
  const Point3d& b = patch_of(meter)->edge2;
  return glm::length(glm::cross(Vec3d(a[0], a[1], a[2]), Vec3d(b[0], b[1], b[2])));
}

}  // namespace

std::string_view quantity_of(const Meter& meter) {
  return std::holds_alternative<RadianceMeter>(meter.kind) ? "radiance"
         : std::holds_alternative<FluxMeter>(meter.kind)   ? "flux"
                                                           : "irradiance";
}

std::string_view radiometric_unit(const Meter& meter) {
  return std::holds_alternative<RadianceMeter>(meter.kind) ? "W/(m² sr)"
         : std::holds_alternative<FluxMeter>(meter.kind)   ? "W"
                                                           : "W/m²";
}

std::string_view photometric_unit(const Meter& meter) {
  return std::holds_alternative<RadianceMeter>(meter.kind) ? "cd/m²"
         : std::holds_alternative<FluxMeter>(meter.kind)   ? "lm"
                                                           : "lx";
}

MeterReading read_meter(const Meter& meter, std::span<const float> sums, std::size_t channels, std::uint64_t samples) {
  LM_CHECK(channels >= 3 && sums.size() == 2 * channels * kTileSize * kTileSize);
  MeterReading reading;
  reading.samples = samples;
  if (samples == 0) {
    return reading;
  }
  constexpr std::size_t pixels = kTileSize * kTileSize;
  const double scale = scale_of(meter) / static_cast<double>(samples);
  const auto estimate = [&](std::size_t pixel) {
    const auto channel = [&](std::size_t c) {
      return (static_cast<double>(sums[c * pixels + pixel]) + sums[(channels + c) * pixels + pixel]) * scale;
    };
    return Vec3d(channel(0), channel(1), channel(2));
  };
  constexpr double n = kTileSize;
  std::array<Vec3d, kTileSize> columns{};
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    columns[pixel % kTileSize] += estimate(pixel) / n;
  }
  reading.rgb = std::accumulate(columns.begin(), columns.end(), Vec3d(0)) / n;
  reading.value = luminance(reading.rgb);
  double squares = 0;
  for (const Vec3d& column : columns) {
    const double difference = luminance(column) - reading.value;
    squares += difference * difference;
  }
  reading.half_width = kStudent95 * std::sqrt(squares / (n * (n - 1)));
  reading.photometric = photometric(reading.value);
  reading.photometric_width = photometric(reading.half_width);
  return reading;
}

}  // namespace lightmill
