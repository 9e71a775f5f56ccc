#include "common/scene/meter_reading.h"

#include <cmath>

#include "common/base/check.h"
#include "common/lights/photometry.h"

namespace lightmill {
namespace {

constexpr double kNormal95 = 1.959963984540054;

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
  LM_CHECK(channels >= 3 && sums.size() % (2 * channels) == 0);
  MeterReading reading;
  reading.samples = samples;
  if (samples == 0) {
    return reading;
  }
  const std::size_t pixels = sums.size() / (2 * channels);
  const double scale = scale_of(meter) / static_cast<double>(samples);
  const auto estimate = [&](std::size_t pixel) {
    const auto channel = [&](std::size_t c) {
      return (static_cast<double>(sums[c * pixels + pixel]) + sums[(channels + c) * pixels + pixel]) * scale;
    };
    return Vec3d(channel(0), channel(1), channel(2));
  };
  Vec3d total(0);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    total += estimate(pixel);
  }
  const auto n = static_cast<double>(pixels);
  reading.rgb = total / n;
  reading.value = luminance(reading.rgb);
  double squares = 0;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const double difference = luminance(estimate(pixel)) - reading.value;
    squares += difference * difference;
  }
  reading.half_width = pixels > 1 ? kNormal95 * std::sqrt(squares / (n * (n - 1))) : 0;
  reading.photometric = photometric(reading.value);
  reading.photometric_width = photometric(reading.half_width);
  return reading;
}

}  // namespace lightmill
