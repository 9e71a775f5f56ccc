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

/// The place of a unit direction on the square of equal areas.
Pair8 sphere_to_square(const V8& d) {
  const F8 x = abs(d.x), y = abs(d.y), z = abs(d.z);
  const F8 across = x * x + y * y;
  const F8 r = sqrt(across) / sqrt(F8(1.0f) + z);  // sqrt(1 - z), without cancellation
  const F8 octant = atan2(min(x, y), max(x, y)) * F8(2 * kInvPi);
  const F8 turn = select(x < y, F8(1.0f) - octant, octant);  // share of the quadrant
  const F8 v = turn * r, u = r - v;
  const M8 below = d.z < F8(0.0f);
  const F8 s = copysign(select(below, F8(1.0f) - v, u), d.x), t = copysign(select(below, F8(1.0f) - u, v), d.y);
  return {(s + F8(1.0f)) * F8(0.5f), (t + F8(1.0f)) * F8(0.5f)};
}

/// The inverse of sphere_to_square.
V8 square_to_sphere_by_area(F8 x, F8 y) {
  const F8 u = x + x - F8(1.0f), v = y + y - F8(1.0f);
  const F8 up = abs(u), vp = abs(v);
  const F8 above = F8(1.0f) - (up + vp);  // negative below the horizon
  const F8 r = F8(1.0f) - abs(above);
  const F8 turn = select(r == F8(0.0f), F8(0.125f), ((vp - up) / r + F8(1.0f)) * F8(0.125f));
  const SinCos8 phi = sin_cos_turns(min(max(turn, F8(0.0f)), F8(0.25f)));
  const F8 sin_theta = r * sqrt(max(F8(2.0f) - r * r, F8(0.0f)));
  return {copysign(phi.cos * sin_theta, u), copysign(phi.sin * sin_theta, v), copysign(F8(1.0f) - r * r, above)};
}

}  // namespace

/// Solid angles of the pixels of each row.
std::vector<double> EnvironmentRadiance::pixel_solid_angles(std::size_t width, std::size_t height) const {
  if (mapping_ == EnvironmentMapping::equal_area) {
    return std::vector<double>(height, 4 * kPiDouble / (static_cast<double>(width) * static_cast<double>(height)));
  }
  std::vector<double> out;
  for (std::size_t row = 0; row < height; ++row) {
    const double top = kPiDouble * static_cast<double>(row) / static_cast<double>(height);
    const double bottom = kPiDouble * static_cast<double>(row + 1) / static_cast<double>(height);
    out.push_back((cos_fixed(top) - cos_fixed(bottom)) * 2 * kPiDouble / static_cast<double>(width));
  }
  return out;
}

EnvironmentRadiance::EnvironmentRadiance(EnvironmentImage image, const Vec3& scale)
    : there_(true),
      scale_(scale),
      rgb_(std::move(image.rgb)),
      width_(image.width),
      height_(image.height),
      mapping_(image.mapping) {
  LM_CHECK(width_ > 0 && height_ > 0 && rgb_.size() == 3 * width_ * height_);
  const double cos_turn = cos_fixed(image.rotation_degrees * kPiDouble / 180);
  const double sin_turn = sin_fixed(image.rotation_degrees * kPiDouble / 180);
  cos_turn_ = static_cast<float>(cos_turn);
  sin_turn_ = static_cast<float>(sin_turn);
  if (image.orientation) {
    const auto& [to_x, to_y, to_z] = *image.orientation;
    rows_ = std::array{Vec3(to_x * cos_turn - to_z * sin_turn), Vec3(to_y), Vec3(to_x * sin_turn + to_z * cos_turn)};
  }
  std::vector<double> weights = mean_luminance_of_pixels();
  const std::vector<double> solid_angles = pixel_solid_angles(width_, height_);
  double flux = 0, largest = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    flux += weights[i] * solid_angles[i / width_];
    largest = std::max(largest, weights[i]);
  }
  mean_luminance_ = flux / (4 * kPiDouble);
  // Only rounding exceeds the mean of a flat image.
  if (largest > mean_luminance_ * (1 + 1e-5)) {
    double excess = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i] = std::max(weights[i] - mean_luminance_, 0.0) * solid_angles[i / width_];
      excess += weights[i];
    }
    bright_share_ = static_cast<float>(std::floor(std::min(excess / flux, kMaxBrightShare) * 0x1p24) * 0x1p-24);
    density_.emplace(weights, width_, height_);
  }
}

/// Luminance of the scaled image, averaged over each pixel. Bilinear interpolation gives the weights 1, 6, 1 in eighths
/// along each axis.
std::vector<double> EnvironmentRadiance::mean_luminance_of_pixels() const {
  const auto at = [&](std::size_t row, std::size_t column) {
    const float* const p = &rgb_[3 * (row * width_ + column)];
    return luminance(Vec3d(p[0], p[1], p[2]) * Vec3d(scale_));
  };
  if (mapping_ == EnvironmentMapping::equal_area) {
    std::vector<double> out(width_ * height_);
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = at(i / width_, i % width_);
    }
    return out;
  }
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

V8 EnvironmentRadiance::to_image(const V8& d) const {
  if (rows_) {
    const auto& [x, y, z] = *rows_;
    return {dot(broadcast(x), d), dot(broadcast(y), d), dot(broadcast(z), d)};
  }
  return {d.x * F8(cos_turn_) - d.z * F8(sin_turn_), d.y, d.x * F8(sin_turn_) + d.z * F8(cos_turn_)};
}

V8 EnvironmentRadiance::from_image(const V8& d) const {
  if (rows_) {
    const auto& [x, y, z] = *rows_;
    return broadcast(x) * d.x + broadcast(y) * d.y + broadcast(z) * d.z;
  }
  return {d.x * F8(cos_turn_) + d.z * F8(sin_turn_), d.y, d.z * F8(cos_turn_) - d.x * F8(sin_turn_)};
}

EnvironmentRadiance::Place8 EnvironmentRadiance::place_of(const V8& direction) const {
  const V8 d = to_image(direction);
  if (mapping_ == EnvironmentMapping::equal_area) {
    const Pair8 place = sphere_to_square(d);
    return {place.u, place.v, F8(4 * kPi)};
  }
  const F8 sin_theta = sqrt(d.x * d.x + d.z * d.z);
  return {F8(0.5f) + atan2(d.z, d.x) * F8(0.5f * kInvPi), atan2(sin_theta, d.y) * F8(kInvPi),
          max(sin_theta, F8(kPoleAngle)) * F8(2 * kPi * kPi)};
}

EnvironmentRadiance::Direction8 EnvironmentRadiance::direction_of(F8 x, F8 y) const {
  if (mapping_ == EnvironmentMapping::equal_area) {
    return {from_image(square_to_sphere_by_area(x, y)), F8(4 * kPi)};
  }
  const SinCos8 theta = sin_cos_turns(y * F8(0.5f));
  const SinCos8 phi = sin_cos_turns(x);  // of the opposite direction, because the image's centre is at +x
  const F8 sin_theta = max(theta.sin, F8(kPoleAngle));
  return {from_image({-(sin_theta * phi.cos), theta.cos, -(sin_theta * phi.sin)}), sin_theta * F8(2 * kPi * kPi)};
}

V8 EnvironmentRadiance::lookup_nearest(F8 x, F8 y) const {
  const auto index = [](F8 share, std::size_t count) {
    const U8 last(static_cast<std::uint32_t>(count - 1));
    const U8 at = truncate(max(share, F8(0.0f)) * F8(static_cast<float>(count)));
    return select(signed_less(last, at), last, at);
  };
  const U8 pixel = index(y, height_) * U8(static_cast<std::uint32_t>(width_)) + index(x, width_);
  return gather3(rgb_.data(), pixel, M8(true)) * broadcast(scale_);
}

V8 EnvironmentRadiance::lookup(F8 x, F8 y) const {
  if (mapping_ == EnvironmentMapping::equal_area) {
    return lookup_nearest(x, y);
  }
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

void EnvironmentRadiance::for_each_beam(const TakeBeam& take) const {
  // Small images are sampled more finely, because they are bilinear between pixel centres.
  constexpr std::size_t kMinWidth = 512, kMinHeight = 256;
  const std::size_t width = width_ * ((kMinWidth + width_ - 1) / width_);
  const std::size_t height = height_ * ((kMinHeight + height_ - 1) / height_);
  const std::vector<double> solid_angles = pixel_solid_angles(width, height);
  for (std::size_t row = 0; row < height; ++row) {
    const F8 y((static_cast<float>(row) + 0.5f) / static_cast<float>(height));
    for (std::size_t column = 0; column < width; column += 8) {
      const M8 lanes = first_lanes(static_cast<int>(std::min<std::size_t>(width - column, 8)));
      const F8 x = (to_float(U8(static_cast<std::uint32_t>(column)) + U8::lane_index()) + F8(0.5f)) *
                   F8(1.0f / static_cast<float>(width));
      const V8 radiance = lookup(min(x, F8(1.0f)), y);
      take(direction_of(x, y).unit, masked(lanes, radiance * F8(static_cast<float>(solid_angles[row]))));
    }
  }
}

LightSample8 EnvironmentRadiance::sample(const V8& p, Pair8 u) const {
  const PiecewiseConstant2D::Sample8 drawn = density_->sample(u);
  const auto [wi, solid_angle] = direction_of(drawn.x, drawn.y);
  const F8 pdf = drawn.pdf / solid_angle;
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
  return density_->pdf(place.x, place.y) / place.solid_angle;
}

double EnvironmentRadiance::irradiance() const {
  return 4 * kPiDouble * (rgb_.empty() ? luminance(Vec3d(scale_)) : mean_luminance_);
}

std::uint64_t EnvironmentRadiance::bytes() const {
  return rgb_.size() * 4 + (density_ ? (width_ + 1) * (height_ + 1) * 4 : 0);
}

}  // namespace lightmill
