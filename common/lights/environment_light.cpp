#include "common/lights/environment_light.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/lights/photometry.h"

namespace lightmill {
namespace {

/// Smallest angle to a pole, in radians, in densities per solid angle.
constexpr float kPoleAngle = 1e-6f;
/// Largest share of the light that is drawn by its excess over the mean. The rest covers the darkest directions.
constexpr double kMaxBrightShare = 1 - 1.0 / 64;

/// Solid angles of the pixels of each row.
std::vector<double> pixel_solid_angles(std::size_t width, std::size_t height) {
  std::vector<double> out;
  for (std::size_t row = 0; row < height; ++row) {
    const double top = kPiDouble * static_cast<double>(row) / static_cast<double>(height);
    const double bottom = kPiDouble * static_cast<double>(row + 1) / static_cast<double>(height);
    out.push_back((cos_fixed(top) - cos_fixed(bottom)) * 2 * kPiDouble / static_cast<double>(width));
  }
  return out;
}

}  // namespace

EnvironmentRadiance::EnvironmentRadiance(std::vector<float> rgb, std::size_t width, std::size_t height,
                                         const Vec3& scale, double rotation_degrees)
    : there_(true),
      scale_(scale),
      rgb_(std::move(rgb)),
      width_(width),
      height_(height),
      cos_turn_(static_cast<float>(cos_fixed(rotation_degrees * kPiDouble / 180))),
      sin_turn_(static_cast<float>(sin_fixed(rotation_degrees * kPiDouble / 180))) {
  LM_CHECK(width > 0 && height > 0 && rgb_.size() == 3 * width * height);
  std::vector<double> weights = mean_luminance_of_pixels();
  const std::vector<double> solid_angles = pixel_solid_angles(width, height);
  double flux = 0, largest = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    flux += weights[i] * solid_angles[i / width];
    largest = std::max(largest, weights[i]);
  }
  mean_luminance_ = flux / (4 * kPiDouble);
  // Only rounding exceeds the mean of a flat image.
  if (largest > mean_luminance_ * (1 + 1e-5)) {
    double excess = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i] = std::max(weights[i] - mean_luminance_, 0.0) * solid_angles[i / width];
      excess += weights[i];
    }
    bright_share_ = static_cast<float>(std::floor(std::min(excess / flux, kMaxBrightShare) * 0x1p24) * 0x1p-24);
    density_.emplace(weights, width, height);
  }
}

/// Luminance of the scaled image, averaged over each pixel. Bilinear interpolation gives the weights 1, 6, 1 in eighths
/// along each axis.
std::vector<double> EnvironmentRadiance::mean_luminance_of_pixels() const {
  const auto at = [&](std::size_t row, std::size_t column) {
    const float* const p = &rgb_[3 * (row * width_ + column)];
    return luminance(Vec3d(p[0], p[1], p[2]) * Vec3d(scale_));
  };
  const auto across = [&](std::size_t row) {
    std::vector<double> means(width_);
    for (std::size_t column = 0; column < width_; ++column) {
      const std::size_t left = (column + width_ - 1) % width_, right = (column + 1) % width_;
      means[column] = (at(row, left) + 6 * at(row, column) + at(row, right)) / 8;
    }
    return means;
  };
  std::vector<double> out(width_ * height_);
  std::vector<double> here = across(0), above = here;
  for (std::size_t row = 0; row < height_; ++row) {
    std::vector<double> below = row + 1 < height_ ? across(row + 1) : here;
    for (std::size_t column = 0; column < width_; ++column) {
      out[row * width_ + column] = (above[column] + 6 * here[column] + below[column]) / 8;
    }
    above = std::exchange(here, std::move(below));
  }
  return out;
}

EnvironmentRadiance::Place8 EnvironmentRadiance::place_of(const V8& d) const {
  const F8 x = d.x * F8(cos_turn_) - d.z * F8(sin_turn_);
  const F8 z = d.x * F8(sin_turn_) + d.z * F8(cos_turn_);
  const F8 sin_theta = sqrt(x * x + z * z);
  return {F8(0.5f) + atan2(z, x) * F8(0.5f * kInvPi), atan2(sin_theta, d.y) * F8(kInvPi), sin_theta};
}

V8 EnvironmentRadiance::lookup(F8 x, F8 y) const {
  // Between the centres of four pixels. `column` and `row` are those of the upper left one, plus 1 so that they are
  // positive.
  const auto within = [](F8 share) { return min(max(share, F8(0.0f)), F8(1.0f)); };
  const F8 px = within(x) * F8(static_cast<float>(width_)) + F8(0.5f);
  const F8 py = within(y) * F8(static_cast<float>(height_)) + F8(0.5f);
  const U8 column = truncate(px), row = truncate(py);
  const F8 s = px - to_float(column), t = py - to_float(row);
  const U8 width(static_cast<std::uint32_t>(width_));
  const auto wrapped = [&](U8 c) {  // c − 1 modulo width, for c in [0, width + 1]
    const U8 left = select(c == U8(0u), width - U8(1u), c - U8(1u));
    return select(left == width, U8(0u), left);
  };
  const auto clamped = [&](U8 r) {  // r − 1 within [0, height)
    const U8 above = select(r == U8(0u), U8(0u), r - U8(1u));
    const U8 last(static_cast<std::uint32_t>(height_ - 1));
    return select(signed_less(last, above), last, above);
  };
  const U8 left = wrapped(column), right = wrapped(column + U8(1u));
  const U8 top = clamped(row) * width, bottom = clamped(row + U8(1u)) * width;
  const auto in_row = [&](U8 first) {
    const M8 all(true);
    const V8 a = gather3(rgb_.data(), first + left, all), b = gather3(rgb_.data(), first + right, all);
    return a + (b - a) * s;
  };
  const V8 a = in_row(top), b = in_row(bottom);
  return (a + (b - a) * t) * broadcast(scale_);
}

V8 EnvironmentRadiance::radiance(const V8& direction) const {
  if (rgb_.empty()) {
    return broadcast(scale_);
  }
  const Place8 place = place_of(direction);
  return lookup(place.x, place.y);
}

Vec3d EnvironmentRadiance::mean_radiance() const {
  if (rgb_.empty()) {
    return Vec3d(scale_);
  }
  const std::vector<double> solid_angles = pixel_solid_angles(width_, height_);
  Vec3d sum(0);
  for (std::size_t row = 0; row < height_; ++row) {
    Vec3d of_row(0);
    for (std::size_t column = 0; column < width_; ++column) {
      const float* const p = &rgb_[3 * (row * width_ + column)];
      of_row += Vec3d(p[0], p[1], p[2]);
    }
    sum += of_row * solid_angles[row];
  }
  return sum / (4 * kPiDouble) * Vec3d(scale_);
}

V8 EnvironmentRadiance::direction_of(F8 x, F8 sin_theta, F8 cos_theta) const {
  const SinCos8 phi = sin_cos_turns(x);  // of the opposite direction, because the image's centre is at +x
  const F8 to_x = -(sin_theta * phi.cos), to_z = -(sin_theta * phi.sin);
  return {to_x * F8(cos_turn_) + to_z * F8(sin_turn_), cos_theta, to_z * F8(cos_turn_) - to_x * F8(sin_turn_)};
}

void EnvironmentRadiance::for_each_beam(const TakeBeam& take) const {
  // Small images are sampled more finely, because they are bilinear between pixel centres.
  constexpr std::size_t kMinWidth = 512, kMinHeight = 256;
  const std::size_t width = width_ * ((kMinWidth + width_ - 1) / width_);
  const std::size_t height = height_ * ((kMinHeight + height_ - 1) / height_);
  const std::vector<double> solid_angles = pixel_solid_angles(width, height);
  for (std::size_t row = 0; row < height; ++row) {
    const F8 y((static_cast<float>(row) + 0.5f) / static_cast<float>(height));
    const SinCos8 theta = sin_cos_turns(y * F8(0.5f));
    for (std::size_t column = 0; column < width; column += 8) {
      const M8 lanes = first_lanes(static_cast<int>(std::min<std::size_t>(width - column, 8)));
      const F8 x = (to_float(U8(static_cast<std::uint32_t>(column)) + U8::lane_index()) + F8(0.5f)) *
                   F8(1.0f / static_cast<float>(width));
      const V8 radiance = lookup(min(x, F8(1.0f)), y);
      take(direction_of(x, theta.sin, theta.cos), masked(lanes, radiance * F8(static_cast<float>(solid_angles[row]))));
    }
  }
}

LightSample8 EnvironmentRadiance::sample(const V8& p, Pair8 u) const {
  const PiecewiseConstant2D::Sample8 drawn = density_->sample(u);
  const SinCos8 theta = sin_cos_turns(drawn.y * F8(0.5f));
  const F8 sin_theta = max(theta.sin, F8(kPoleAngle));
  const V8 wi = direction_of(drawn.x, sin_theta, theta.cos);
  const F8 pdf = drawn.pdf / (sin_theta * F8(2 * kPi * kPi));
  return {p + wi * F8(kFarAway), wi, lookup(drawn.x, drawn.y) * (F8(1.0f) / pdf), pdf, pdf > F8(0.0f)};
}

EnvironmentRadiance::Beam8 EnvironmentRadiance::sample_all(Pair8 u) const {
  const F8 share(bright_share_), uniform_pdf(0.25f * kInvPi);
  const M8 bright = u.u < share;
  const F8 rest = F8(1.0f) - share;
  const V8 anywhere = square_to_sphere({(u.u - share) / rest, u.v});
  if (!density_) {
    return {anywhere, radiance(anywhere) * (F8(1.0f) / uniform_pdf)};
  }
  const LightSample8 drawn = sample(broadcast(Vec3(0)), {select(bright, u.u / share, F8(0.0f)), u.v});
  const V8 wi = select(bright, drawn.wi, anywhere);
  const F8 bright_pdf = select(bright, drawn.pdf_solid_angle, pdf_solid_angle(wi));
  const V8 from_there = select(bright, drawn.weight * drawn.pdf_solid_angle, radiance(wi));
  return {wi, from_there * (F8(1.0f) / (share * bright_pdf + rest * uniform_pdf))};
}

F8 EnvironmentRadiance::all_pdf_solid_angle(const V8& direction) const {
  const F8 share(density_ ? bright_share_ : 0.0f);
  return share * pdf_solid_angle(direction) + (F8(1.0f) - share) * F8(0.25f * kInvPi);
}

F8 EnvironmentRadiance::pdf_solid_angle(const V8& direction) const {
  if (!density_) {
    return F8(0.0f);
  }
  const Place8 place = place_of(direction);
  return density_->pdf(place.x, place.y) / (max(place.sin_theta, F8(kPoleAngle)) * F8(2 * kPi * kPi));
}

double EnvironmentRadiance::irradiance() const {
  return 4 * kPiDouble * (rgb_.empty() ? luminance(Vec3d(scale_)) : mean_luminance_);
}

std::uint64_t EnvironmentRadiance::bytes() const {
  return rgb_.size() * 4 + (density_ ? (width_ + 1) * (height_ + 1) * 4 : 0);
}

}  // namespace lightmill
