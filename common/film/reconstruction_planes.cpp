#include "common/film/reconstruction_planes.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// Calls f(place, pixel) for all places. Those outside the picture have the nearest pixel.
template <class F>
void for_each_place(const PaddedPlaces& places, int width, int height, F&& f) {
  const int last = static_cast<int>(2 * places.stride) - kPad;
  for (int y = -kPad; y < places.height + kPad; ++y) {
    const auto row = static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width);
    for (int x = -kPad; x < last; ++x) {
      f(places.at(x, y), row + static_cast<std::size_t>(std::clamp(x, 0, width - 1)));
    }
  }
}

/// Means over 5×5 pixels of those that are known.
std::vector<float> smoothed(const std::vector<float>& values, const std::vector<float>& known, int width, int height) {
  const auto blur = [&](const std::vector<float>& from, int dx, int dy) {
    std::vector<float> to(from.size());
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        float sum = 0;
        for (int k = -2; k <= 2; ++k) {
          const int u = x + k * dx, v = y + k * dy;
          sum += u >= 0 && v >= 0 && u < width && v < height ? from[static_cast<std::size_t>(v) * width + u] : 0.0f;
        }
        to[static_cast<std::size_t>(y) * width + x] = sum;
      }
    }
    return to;
  };
  std::vector<float> sums = blur(blur(values, 1, 0), 0, 1);
  const std::vector<float> counts = blur(blur(known, 1, 0), 0, 1);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    sums[i] = counts[i] > 0 ? sums[i] / counts[i] : 0.0f;
  }
  return sums;
}

}  // namespace

ReconstructionPlanes::ReconstructionPlanes(const ReconstructionInput& film)
    : places(film.width, (film.height + 2 * kCenterRows - 1) / (2 * kCenterRows) * 2 * kCenterRows) {
  const int width = film.width, height = film.height;
  const std::size_t pixels = film.samples_a.size();
  std::vector<float> is_known(pixels), noise(pixels);
  double sum = 0, count = 0;
  const std::size_t feature_values = film.features.size();
  for (std::size_t i = 0; i < pixels; ++i) {
    bool finite = film.samples_a[i] > 0 && film.samples_b[i] > 0;
    for (std::size_t c = 0; c < 3; ++c) {
      finite = finite && std::abs(film.half_a[c * pixels + i]) < 1e12f && std::abs(film.half_b[c * pixels + i]) < 1e12f;
    }
    for (std::size_t v = i; v < feature_values; v += pixels) {
      finite = finite && std::abs(film.features[v]) < 1e12f;
    }
    if (!finite) {
      continue;
    }
    is_known[i] = 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const float a = film.half_a[c * pixels + i], b = film.half_b[c * pixels + i];
      noise[i] += (a - b) * (a - b) / 2;
      sum += std::min(std::abs(a), std::abs(b));
      ++count;
    }
  }
  brightness = count > 0 ? static_cast<float>(sum / count) : 0.0f;
  noise = smoothed(noise, is_known, width, height);
  for (std::size_t i = 0; i < pixels; ++i) {
    noise[i] = is_known[i] > 0 ? noise[i] : kUnknownVariance;
  }
  const auto spread = [&](PaddedPlane& plane, auto&& value_of) {
    plane.resize(places.size());
    for_each_place(places, width, height, [&](std::size_t to, std::size_t from) { plane[to] = value_of(from); });
  };
  for (std::size_t half = 0; half < 2; ++half) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::span<const float> plane = (half == 0 ? film.half_a : film.half_b).subspan(c * pixels, pixels);
      spread(halves[half][c], [&](std::size_t i) { return is_known[i] > 0 ? plane[i] : 0.0f; });
    }
  }
  spread(variance, [&](std::size_t i) { return noise[i]; });
  known.resize(places.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      known[places.at(x, y)] = is_known[static_cast<std::size_t>(y) * width + x];
    }
  }
  const auto feature = [&](std::size_t plane, std::size_t i) {
    return is_known[i] > 0 ? film.features[plane * pixels + i] + film.features[(kFeaturePlanes + plane) * pixels + i]
                           : 0.0f;
  };
  for (std::size_t f = 0; f < kFeatures; ++f) {
    spread(features[f], [&](std::size_t i) { return feature(f, i); });
  }
  for (std::size_t group = 0; group < 3; ++group) {
    const std::size_t first = 3 * group, channels = group == 2 ? 1 : 3;
    spread(feature_noise[group], [&](std::size_t i) {
      float variance_of_sample = feature(kFeatures + group, i);
      for (std::size_t f = first; f < first + channels; ++f) {
        variance_of_sample -= feature(f, i) * feature(f, i);
      }
      const auto samples = static_cast<float>(std::clamp(film.samples_a[i] + film.samples_b[i], 1u, 16u));
      return std::max(variance_of_sample, 0.0f) / (samples * static_cast<float>(channels));
    });
  }
}

}  // namespace lightmill
