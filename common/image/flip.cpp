#include "common/image/flip.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>

#include "common/image/error_metrics.h"

namespace lightmill {
namespace {

using Color = std::array<double, 3>;
using Plane = std::vector<float>;

// Contrast sensitivity as sums of two Gaussians for the achromatic, red-green and blue-yellow channels.
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr Sensitivity kAchromatic{1, 0.0047, 0, 1e-5};
constexpr Sensitivity kRedGreen{1, 0.0053, 0, 1e-5};
constexpr Sensitivity kBlueYellow{34.1, 0.04, 13.5, 0.025};
constexpr double kWidestGaussian = 0.04;

constexpr double kColorExponent = 0.7;    // q_c
constexpr double kColorKnee = 0.4;        // p_c
constexpr double kColorAtKnee = 0.95;     // p_t
constexpr double kFeatureExponent = 0.5;  // q_f
constexpr double kFeatureWidth = 0.082;   // w, degrees

constexpr Color kWhite{0.950428545, 1.0, 1.088900371};  // D65

// Linear sRGB to CIE XYZ and back, as fractions whose rows sum to this white.
Color xyz_of(const Color& rgb) {
  return {(10135552.0 * rgb[0] + 8788810.0 * rgb[1] + 4435075.0 * rgb[2]) / 24577794.0,
          (2613072.0 * rgb[0] + 8788810.0 * rgb[1] + 887015.0 * rgb[2]) / 12288897.0,
          (1425312.0 * rgb[0] + 8788810.0 * rgb[1] + 70074185.0 * rgb[2]) / 73733382.0};
}

Color rgb_of(const Color& xyz) {
  return {3.241003275 * xyz[0] - 1.537398934 * xyz[1] - 0.498615861 * xyz[2],
          -0.969224334 * xyz[0] + 1.875930071 * xyz[1] + 0.041554224 * xyz[2],
          0.055639423 * xyz[0] - 0.204011202 * xyz[1] + 1.057148933 * xyz[2]};
}

/// The opponent space YCxCz, a linear CIELAB.
Color opponent_of(const Color& rgb) {
  const Color xyz = xyz_of(rgb);
  const double x = xyz[0] / kWhite[0], y = xyz[1] / kWhite[1], z = xyz[2] / kWhite[2];
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

Color rgb_of_opponent(const Color& opponent) {
  const double y = (opponent[0] + 16) / 116;
  return rgb_of({(y + opponent[1] / 500) * kWhite[0], y * kWhite[1], (y - opponent[2] / 200) * kWhite[2]});
}

double lab_curve(double t) {
  constexpr double kDelta = 6.0 / 29.0;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29.0;
}

/// CIELAB with the Hunt effect: colours look stronger in brighter light.
Color hunt_lab_of(const Color& rgb) {
  const Color xyz = xyz_of(rgb);
  const double x = lab_curve(xyz[0] / kWhite[0]), y = lab_curve(xyz[1] / kWhite[1]), z = lab_curve(xyz[2] / kWhite[2]);
  const double lightness = 116 * y - 16;
  return {lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)};
}

/// The HyAB distance of large colour differences, to the power q_c.
double color_distance(const Color& one, const Color& other) {
  const double distance = std::abs(one[0] - other[0]) + std::hypot(one[1] - other[1], one[2] - other[2]);
  return std::pow(distance, kColorExponent);
}

/// Distances up to p_c of the largest one (green to blue) map to [0, p_t], larger ones to the rest.
double redistributed(double distance) {
  static const double most = color_distance(hunt_lab_of({0, 1, 0}), hunt_lab_of({0, 0, 1}));
  const double knee = kColorKnee * most;
  const double error = distance < knee ? distance * kColorAtKnee / knee
                                       : kColorAtKnee + (distance - knee) / (most - knee) * (1 - kColorAtKnee);
  return std::clamp(error, 0.0, 1.0);
}

// ---- filters; border pixels continue outside ----

using Kernel = std::vector<float>;  // of odd length, centred at 0

Kernel to_kernel(const std::vector<double>& weights, double factor) {
  Kernel kernel(weights.size());
  std::ranges::transform(weights, kernel.begin(), [&](double weight) { return static_cast<float>(weight * factor); });
  return kernel;
}

struct Size {
  int width = 0, height = 0;
};

Plane filter_rows(const Plane& in, Size size, const Kernel& kernel) {
  const int radius = static_cast<int>(kernel.size() / 2);
  const auto width = static_cast<std::size_t>(size.width);
  std::vector<float> row(width + kernel.size());
  Plane out(in.size(), 0.0f);
  for (std::size_t y = 0; y < static_cast<std::size_t>(size.height); ++y) {
    for (int x = -radius; x < size.width + radius; ++x) {
      row[static_cast<std::size_t>(x + radius)] =
          in[y * width + static_cast<std::size_t>(std::clamp(x, 0, size.width - 1))];
    }
    float* const to = &out[y * width];
    for (std::size_t k = 0; k < kernel.size(); ++k) {
      for (std::size_t x = 0; x < width; ++x) {
        to[x] += kernel[k] * row[x + k];
      }
    }
  }
  return out;
}

Plane filter_columns(const Plane& in, Size size, const Kernel& kernel) {
  const int radius = static_cast<int>(kernel.size() / 2);
  const auto width = static_cast<std::size_t>(size.width);
  Plane out(in.size(), 0.0f);
  for (int y = 0; y < size.height; ++y) {
    float* const to = &out[static_cast<std::size_t>(y) * width];
    for (std::size_t k = 0; k < kernel.size(); ++k) {
      const int from_y = std::clamp(y + static_cast<int>(k) - radius, 0, size.height - 1);
      const float* const from = &in[static_cast<std::size_t>(from_y) * width];
      for (std::size_t x = 0; x < width; ++x) {
        to[x] += kernel[k] * from[x];
      }
    }
  }
  return out;
}

Plane filter(const Plane& in, Size size, const Kernel& along_x, const Kernel& along_y) {
  return filter_columns(filter_rows(in, size, along_x), size, along_y);
}

/// exp(−x²/(2 σ²)) at integer x, and the sum.
std::pair<std::vector<double>, double> gaussian(int radius, double sigma) {
  std::vector<double> weights;
  for (int x = -radius; x <= radius; ++x) {
    weights.push_back(std::exp(-x * x / (2 * sigma * sigma)));
  }
  return {weights, std::accumulate(weights.begin(), weights.end(), 0.0)};
}

/// Blurs by the observer's contrast sensitivity: a₁√(π/b₁) exp(−π²x²/b₁) + the same with a₂ and b₂, in two dimensions,
/// normalised. Each term is separable in x and y.
Plane as_seen(const Plane& in, Size size, const Sensitivity& eye, double pixels_per_degree) {
  const double pi = M_PI;
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(kWidestGaussian / (2 * pi * pi)) * pixels_per_degree));
  Plane out(in.size(), 0.0f);
  double total = 0;
  std::vector<std::pair<double, std::vector<double>>> parts;
  for (const auto& [a, b] : {std::pair{eye.a1, eye.b1}, std::pair{eye.a2, eye.b2}}) {
    if (a > 0) {
      const auto [weights, sum] = gaussian(radius, std::sqrt(b / 2) / pi * pixels_per_degree);
      parts.emplace_back(a * std::sqrt(pi / b), weights);
      total += parts.back().first * sum * sum;
    }
  }
  for (const auto& [factor, weights] : parts) {
    const Plane part = filter(in, size, to_kernel(weights, factor / total), to_kernel(weights, 1));
    std::ranges::transform(out, part, out.begin(), std::plus<>());
  }
  return out;
}

/// Lengths of a filter's gradients. Positive and negative weights of `along` sum to ±1.
Plane feature_lengths(const Plane& luma, Size size, std::vector<double> along, const Kernel& across) {
  double positive = 0, negative = 0;
  for (const double weight : along) {
    (weight > 0 ? positive : negative) += std::abs(weight);
  }
  for (double& weight : along) {
    weight /= weight > 0 ? positive : negative;
  }
  const Kernel kernel = to_kernel(along, 1);
  Plane x = filter(luma, size, kernel, across);
  const Plane y = filter(luma, size, across, kernel);
  std::ranges::transform(x, y, x.begin(), [](float one, float other) { return std::hypot(one, other); });
  return x;
}

struct Features {
  Plane edges, points;
};

/// Edges by the first and points by the second derivative of a Gaussian (the paper's feature pipeline).
Features features_of(const Plane& luma, Size size, double pixels_per_degree) {
  const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  const auto [weights, sum] = gaussian(radius, sigma);
  std::vector<double> first = weights, second = weights;
  for (int x = -radius; x <= radius; ++x) {
    first[static_cast<std::size_t>(x + radius)] *= -x;
    second[static_cast<std::size_t>(x + radius)] *= x * x / (sigma * sigma) - 1;
  }
  const Kernel across = to_kernel(weights, 1 / sum);
  return {feature_lengths(luma, size, first, across), feature_lengths(luma, size, second, across)};
}

// ---- the two pipelines ----

/// A picture as the observer sees it.
struct Seen {
  std::array<Plane, 3> hunt_lab;
  Features features;
};

Seen see(const std::vector<float>& rgb, Size size, double pixels_per_degree) {
  const std::size_t pixels = rgb.size() / 3;
  std::array<Plane, 3> opponent;
  opponent.fill(Plane(pixels));
  Plane luma(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Color color = opponent_of({rgb[i], rgb[pixels + i], rgb[2 * pixels + i]});
    for (std::size_t c = 0; c < 3; ++c) {
      opponent[c][i] = static_cast<float>(color[c]);
    }
    luma[i] = static_cast<float>((color[0] + 16) / 116);
  }
  opponent = {as_seen(opponent[0], size, kAchromatic, pixels_per_degree),
              as_seen(opponent[1], size, kRedGreen, pixels_per_degree),
              as_seen(opponent[2], size, kBlueYellow, pixels_per_degree)};
  for (std::size_t i = 0; i < pixels; ++i) {
    Color color = rgb_of_opponent({opponent[0][i], opponent[1][i], opponent[2][i]});
    for (double& value : color) {
      value = std::clamp(value, 0.0, 1.0);
    }
    color = hunt_lab_of(color);
    for (std::size_t c = 0; c < 3; ++c) {
      opponent[c][i] = static_cast<float>(color[c]);
    }
  }
  return {std::move(opponent), features_of(luma, size, pixels_per_degree)};
}

/// ΔE_c^(1 − ΔE_f) for values in [0, 1].
Plane flip_of_shown(const std::vector<float>& picture, const std::vector<float>& reference, Size size,
                    double pixels_per_degree) {
  const Seen test = see(picture, size, pixels_per_degree);
  const Seen truth = see(reference, size, pixels_per_degree);
  const auto color_at = [](const Seen& seen, std::size_t i) {
    return Color{seen.hunt_lab[0][i], seen.hunt_lab[1][i], seen.hunt_lab[2][i]};
  };
  Plane map(picture.size() / 3);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double color = redistributed(color_distance(color_at(test, i), color_at(truth, i)));
    const double edge = std::abs(double{test.features.edges[i]} - double{truth.features.edges[i]});
    const double point = std::abs(double{test.features.points[i]} - double{truth.features.points[i]});
    const double feature = std::min(std::pow(std::max(edge, point) / std::sqrt(2.0), kFeatureExponent), 1.0);
    map[i] = static_cast<float>(color > 0 ? std::pow(color, 1 - feature) : 0.0);
  }
  return map;
}

// ---- exposures ----

// K. Narkowicz's ACES curve with its factor 0.6: (k0 x² + k1 x)/(k3 x² + k4 x + k5).
constexpr double kCurve0 = 0.6 * 0.6 * 2.51, kCurve1 = 0.6 * 0.03;
constexpr double kCurve3 = 0.6 * 0.6 * 2.43, kCurve4 = 0.6 * 0.59, kCurve5 = 0.14;
constexpr double kShownAs = 0.85;  // displayed value of the brightest pixel, and of the median
constexpr double kMaxExposures = 64;

std::vector<float> tone_mapped(const std::vector<float>& linear, double exposure) {
  const double factor = std::exp2(exposure);
  std::vector<float> shown(linear.size());
  std::ranges::transform(linear, shown.begin(), [&](float value) {
    const double x = std::min(std::max(double{value}, 0.0) * factor, 1e9);
    return static_cast<float>(
        std::clamp((kCurve0 * x * x + kCurve1 * x) / (kCurve3 * x * x + kCurve4 * x + kCurve5), 0.0, 1.0));
  });
  return shown;
}

/// The exposures for a reference, ascending, in stops.
std::vector<double> exposures_for(const RgbImage& reference) {
  const std::size_t pixels = reference.pixels();
  std::vector<double> luminance(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    luminance[i] = 0.2126 * std::max(reference.values[i], 0.0f) +
                   0.7152 * std::max(reference.values[pixels + i], 0.0f) +
                   0.0722 * std::max(reference.values[2 * pixels + i], 0.0f);
  }
  std::ranges::sort(luminance);
  const auto median = [](std::span<const double> sorted) {
    return (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]) / 2;
  };
  const auto lit = std::ranges::upper_bound(luminance, 0.0);
  if (lit == luminance.end()) {
    return {0.0};
  }
  double middle = median(luminance);
  middle = middle > 0 ? middle : median({lit, luminance.end()});
  // The positive x that the curve maps to kShownAs.
  const double a = kCurve0 - kCurve3 * kShownAs, b = kCurve1 - kCurve4 * kShownAs, c = -kCurve5 * kShownAs;
  const double x = (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
  const double start = std::log2(x / luminance.back()), stop = std::log2(x / middle);
  const auto count = static_cast<std::size_t>(std::clamp(std::ceil(stop - start), 2.0, kMaxExposures));
  std::vector<double> exposures(count);
  for (std::size_t i = 0; i < count; ++i) {
    exposures[i] = start + (stop - start) * static_cast<double>(i) / static_cast<double>(count - 1);
  }
  return exposures;
}

}  // namespace

Result<std::vector<float>> flip_map(const RgbImage& picture, const RgbImage& reference, double pixels_per_degree) {
  LM_RETURN_IF_ERROR(check_comparable(picture, reference));
  const auto shown = [](std::vector<float> values) {
    std::ranges::transform(values, values.begin(), [](float value) { return std::clamp(value, 0.0f, 1.0f); });
    return values;
  };
  return flip_of_shown(shown(picture.values), shown(reference.values), {picture.width, picture.height},
                       pixels_per_degree);
}

Result<std::vector<float>> hdr_flip_map(const RgbImage& picture, const RgbImage& reference, double pixels_per_degree) {
  LM_RETURN_IF_ERROR(check_comparable(picture, reference));
  Plane map(picture.pixels(), 0.0f);
  for (const double exposure : exposures_for(reference)) {
    const Plane one = flip_of_shown(tone_mapped(picture.values, exposure), tone_mapped(reference.values, exposure),
                                    {picture.width, picture.height}, pixels_per_degree);
    std::ranges::transform(map, one, map.begin(), [](float most, float here) { return std::max(most, here); });
  }
  return map;
}

double mean_flip(const std::vector<float>& map) {
  return map.empty() ? 0.0 : std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
}

}  // namespace lightmill
