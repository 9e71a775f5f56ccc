#include "common/image/error_metrics.h"

#include <algorithm>
#include <cmath>

#include "common/math/rel_mse.h"

namespace lightmill {
namespace {

Status check_finite(const RgbImage& image, std::string_view what) {
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    if (!std::isfinite(image.values[i])) {
      const std::size_t pixel = i % image.pixels();
      return invalid_argument("{}: pixel ({}, {}) is {}, expected a finite number", what, pixel % image.width,
                              pixel / image.width, image.values[i]);
    }
  }
  return ok_status();
}

double ratio_of(double sum_x, double sum_r) {
  return sum_x == sum_r ? 1.0 : sum_x / sum_r;
}

}  // namespace

Status check_comparable(const RgbImage& picture, const RgbImage& reference) {
  if (picture.width != reference.width || picture.height != reference.height) {
    return invalid_argument("the pictures must have the same size, got {}x{} and {}x{}", picture.width, picture.height,
                            reference.width, reference.height);
  }
  LM_RETURN_IF_ERROR(check_finite(picture, "picture"));
  return check_finite(reference, "reference");
}

Result<PictureError> compare_pictures(const RgbImage& picture, const RgbImage& reference) {
  LM_RETURN_IF_ERROR(check_comparable(picture, reference));
  const std::size_t pixels = picture.pixels();
  std::vector<double> per_pixel(pixels, 0.0);
  std::array<double, 3> sums_x{}, sums_r{};
  PictureError error;
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    const double x = picture.values[i];
    const double r = reference.values[i];
    const double distance = std::abs(x - r);
    per_pixel[i % pixels] += distance * distance / (r * r + kRelMseFloor) / 3.0;
    error.smape += distance > 0 ? distance / (std::abs(x) + std::abs(r)) : 0.0;
    error.max_abs = std::max(error.max_abs, distance);
    sums_x[i / pixels] += x;
    sums_r[i / pixels] += r;
  }
  error.smape /= static_cast<double>(picture.values.size());
  std::ranges::transform(sums_x, sums_r, error.energy_ratio_rgb.begin(), ratio_of);
  error.energy_ratio = ratio_of(sums_x[0] + sums_x[1] + sums_x[2], sums_r[0] + sums_r[1] + sums_r[2]);
  std::ranges::sort(per_pixel);  // ascending: adding small terms first keeps the sum accurate, and the worst come last
  const std::size_t kept = pixels - pixels / 1000;
  double sum = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    sum += per_pixel[i];
    if (i + 1 == kept) {
      error.rel_mse_trimmed = sum / static_cast<double>(kept);
    }
  }
  error.rel_mse = sum / static_cast<double>(pixels);
  return error;
}

}  // namespace lightmill
