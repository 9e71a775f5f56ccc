#include "common/lights/ies_light.h"

#include <algorithm>
#include <bit>

#include "common/lights/photometry.h"
#include "common/lights/point_light.h"

namespace lightmill {
namespace {

/// Bisection steps that find one of the cells between this many angles.
int steps_among(std::size_t angles) {
  return std::bit_width(angles - 2);
}

/// The largest i below count − 1 with values[first + i] <= x, or 0.
U8 cell_of(const std::vector<float>& values, U8 first, U8 count, F8 x, int steps, M8 lanes) {
  U8 low(0u);
  U8 high = count - U8(2u);
  for (int step = 0; step < steps; ++step) {
    const U8 middle = (low + high + U8(1u)) >> 1;
    const M8 right = gather(values.data(), first + middle, lanes) <= x;
    low = select(right, middle, low);
    high = select(right, high, select(middle == U8(0u), middle, middle - U8(1u)));
  }
  return low;
}

}  // namespace

std::size_t IesLights::add_profile(const IesProfile& profile) {
  const auto size = [](const auto& array) { return static_cast<std::uint32_t>(array.size()); };
  profiles_.push_back({size(vertical_), size(profile.vertical), size(horizontal_), size(profile.horizontal),
                       size(candela_), profile.lumen(), std::ranges::max(profile.candela)});
  const auto append = [](std::vector<float>& to, const std::vector<double>& from) {
    for (const double x : from) {
      to.push_back(static_cast<float>(x));
    }
  };
  append(vertical_, profile.vertical);
  append(horizontal_, profile.horizontal);
  append(candela_, profile.candela);
  vertical_steps_ = std::max(vertical_steps_, steps_among(profile.vertical.size()));
  horizontal_steps_ = std::max(horizontal_steps_, steps_among(profile.horizontal.size()));
  return profiles_.size() - 1;
}

void IesLights::add(const IesEmitter& light) {
  const Profile& profile = profiles_[light.profile];
  position_.add(light.position);
  direction_.add(light.direction);
  reference_.add(light.reference);
  per_candela_.add(light.per_candela);
  profile_.push_back(static_cast<std::uint32_t>(light.profile));
  first_vertical_.push_back(profile.vertical);
  verticals_.push_back(profile.verticals);
  first_horizontal_.push_back(profile.horizontal);
  horizontals_.push_back(profile.horizontals);
  first_value_.push_back(profile.value);
}

LightBounds IesLights::bounds(std::size_t i) const {
  const Profile& profile = profiles_[profile_[i]];
  const double per_candela = luminance(Vec3d(per_candela_[i]));
  return bounds_of_point(position_[i], profile.lumen * per_candela, profile.peak * per_candela);
}

F8 IesLights::candela(U8 index, F8 vertical, F8 horizontal, M8 lanes) const {
  const U8 first_vertical = gather(first_vertical_.data(), index, lanes);
  const U8 verticals = gather(verticals_.data(), index, lanes);
  const U8 first_horizontal = gather(first_horizontal_.data(), index, lanes);
  const U8 i = cell_of(vertical_, first_vertical, verticals, vertical, vertical_steps_, lanes);
  const U8 j = cell_of(horizontal_, first_horizontal, gather(horizontals_.data(), index, lanes), horizontal,
                       horizontal_steps_, lanes);
  const auto share = [&](const std::vector<float>& angles, U8 cell, F8 x) {
    const F8 a = gather(angles.data(), cell, lanes), b = gather(angles.data(), cell + U8(1u), lanes);
    return max(min((x - a) / (b - a), F8(1.0f)), F8(0.0f));
  };
  const F8 s = share(vertical_, first_vertical + i, vertical);
  const F8 t = share(horizontal_, first_horizontal + j, horizontal);
  const U8 corner = gather(first_value_.data(), index, lanes) + j * verticals + i;
  const auto in_row = [&](U8 cell) {
    const F8 a = gather(candela_.data(), cell, lanes), b = gather(candela_.data(), cell + U8(1u), lanes);
    return a + (b - a) * s;
  };
  const F8 here = in_row(corner), there = in_row(corner + verticals);
  const F8 lowest = gather(vertical_.data(), first_vertical, lanes);
  const F8 highest = gather(vertical_.data(), first_vertical + verticals - U8(1u), lanes);
  return masked((vertical >= lowest) & (vertical <= highest), here + (there - here) * t);
}

F8 IesLights::candela(const V8& direction, U8 index, M8 lanes) const {
  const V8 axis = direction_.at(index, lanes);
  const V8 reference = reference_.at(index, lanes);
  const F8 along = dot(direction, axis);
  const F8 x = dot(direction, reference);
  const F8 y = -dot(direction, cross(axis, reference));
  const F8 degrees(180 * kInvPi);
  const F8 vertical = min(atan2(sqrt(x * x + y * y), along) * degrees, F8(180.0f));
  const F8 turn = atan2(y, x) * degrees;
  const F8 horizontal = turn + masked(turn < F8(0.0f), F8(360.0f));
  return candela(index, vertical, horizontal, lanes);
}

LightSample8 IesLights::sample(const V8& p, U8 index, M8 lanes) const {
  const PointView8 view(p, position_.at(index, lanes), lanes);
  const F8 value = candela(view.direction(), index, view.valid);
  return view.light(per_candela_.at(index, lanes), value, value > F8(0.0f));
}

}  // namespace lightmill
