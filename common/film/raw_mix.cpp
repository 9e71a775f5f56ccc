#include "common/film/raw_mix.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// Radius of the two means over which errors are averaged. Together their window has the shape of a tent.
constexpr int kMeanRadius = 8;
/// Pixels darker than this part of the picture's brightness weigh no more than such ones.
constexpr float kLeastBrightness = 0.1f;
/// Limit of one pixel's squared errors, in squares of its brightness.
constexpr double kMaxWeight = 100;

/// Sums over 2·kMeanRadius + 1 values along lines that are `step` apart from value to value.
void sum_along(std::vector<double>& values, int length, std::size_t step, int lines, std::size_t between) {
  std::vector<double> before(static_cast<std::size_t>(length) + 1);
  for (int line = 0; line < lines; ++line) {
    double* const first = values.data() + static_cast<std::size_t>(line) * between;
    for (int i = 0; i < length; ++i) {
      before[static_cast<std::size_t>(i) + 1] =
          before[static_cast<std::size_t>(i)] + first[static_cast<std::size_t>(i) * step];
    }
    for (int i = 0; i < length; ++i) {
      first[static_cast<std::size_t>(i) * step] =
          before[static_cast<std::size_t>(std::min(i + kMeanRadius + 1, length))] -
          before[static_cast<std::size_t>(std::max(i - kMeanRadius, 0))];
    }
  }
}

void sum_around(std::vector<double>& values, int width, int height) {
  for (int pass = 0; pass < 2; ++pass) {
    sum_along(values, width, 1, height, static_cast<std::size_t>(width));
    sum_along(values, height, static_cast<std::size_t>(width), width, 1);
  }
}

}  // namespace

void mix_with_raw(const ReconstructionInput& film, float brightness, std::vector<float>& picture) {
  const std::size_t pixels = film.samples_a.size();
  const float dark = kLeastBrightness * brightness;
  std::vector<double> variance(pixels), difference(pixels);
  std::vector<bool> known(pixels);
  const auto mean_of = [&](std::size_t pixel, std::size_t value) {
    const auto a = static_cast<float>(film.samples_a[pixel]), b = static_cast<float>(film.samples_b[pixel]);
    return (film.half_a[value] * a + film.half_b[value] * b) / (a + b);
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    const double a = film.samples_a[i], b = film.samples_b[i];
    double noise = 0, distance = 0, brightness_here = 0;
    for (std::size_t value = i; value < 3 * pixels; value += pixels) {
      const double halves = static_cast<double>(film.half_a[value]) - static_cast<double>(film.half_b[value]);
      const double apart = static_cast<double>(picture[value]) - static_cast<double>(mean_of(i, value));
      noise += halves * halves * a * b / ((a + b) * (a + b));
      distance += apart * apart;
      brightness_here += static_cast<double>(picture[value]) / 3;
    }
    known[i] = a > 0 && b > 0 && noise + distance < 1e24;
    if (known[i]) {
      const double relative = 1 / (brightness_here * brightness_here + static_cast<double>(dark * dark) + 1e-30);
      // A firefly counts less, and so the running sums keep their precision.
      const double scale = relative / std::max(1.0, std::max(noise, distance) * relative / kMaxWeight);
      variance[i] = noise * scale;
      difference[i] = distance * scale;
    }
  }
  sum_around(variance, film.width, film.height);
  sum_around(difference, film.width, film.height);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (known[i] && variance[i] < difference[i]) {
      const auto share = static_cast<float>(variance[i] / difference[i]);
      for (std::size_t value = i; value < 3 * pixels; value += pixels) {
        picture[value] = share * picture[value] + (1 - share) * mean_of(i, value);
      }
    }
  }
}

}  // namespace lightmill
