#include "common/lights/light_choice.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// Smallest cosine in a bound, and rounding error of a cosine. Lights below the horizon by more than this error are not
/// chosen.
constexpr float kMinCosineAbove = 0.02f, kHorizonRounding = 1e-4f;

/// Bound of the cosine between a unit normal and directions to a sphere; 0 if all of it is below the horizon.
F8 cosine_above(const V8& normal, const V8& to_center, F8 distance, F8 radius) {
  const F8 height = dot(normal, to_center) + radius + distance * F8(kHorizonRounding);
  return masked(height > F8(0.0f), max(min(height / distance, F8(1.0f)), F8(kMinCosineAbove)));
}

}  // namespace

LightChoice::LightChoice(std::span<const LightBounds> bounded, std::span<const DistantBounds> distant)
    : count_(bounded.size() + distant.size()), bounded_(bounded.size()) {
  if (!chooses()) {
    return;
  }
  double unit = 0;
  for (const LightBounds& light : bounded) {
    unit += light.intensity;
  }
  for (const DistantBounds& light : distant) {
    unit += light.irradiance;
  }
  if (!bounded.empty()) {
    tree_ = LightBvh(bounded, unit);
    roots_ = tree_.cut(kMaxEntries);
    has_subtrees_ = roots_.size() < bounded.size();
  }
  group_size_ = static_cast<std::uint32_t>(std::max<std::size_t>((distant.size() + kMaxEntries - 1) / kMaxEntries, 1));
  for (std::size_t first = 0; first < distant.size(); first += group_size_) {
    DistantBounds sum = distant[first];
    for (std::size_t i = first + 1; i < std::min(first + group_size_, distant.size()); ++i) {
      sum.irradiance += distant[i].irradiance;
      sum.radius = DistantBounds::kAnywhere;
    }
    distant_.push_back({static_cast<float>(std::max(sum.irradiance / unit, LightBvh::kMinBound)), Vec3(sum.direction),
                        static_cast<float>(sum.radius)});
  }
}

LightChoice::Entries8 LightChoice::bounds(const V8& p) const {
  Entries8 out;
  std::size_t entry = 0;
  for (const std::uint32_t root : roots_) {
    out[entry++] = tree_.bound(p, root);
  }
  for (const DistantEntry& light : distant_) {
    out[entry++] = F8(light.bound);
  }
  return out;
}

/// Bounds of the light on surfaces with these normals.
LightChoice::Entries8 LightChoice::above(const V8& p, const V8& normal, Entries8 bounds) const {
  const M8 surface = length_squared(normal) > F8(0.0f);
  std::size_t entry = 0;
  const auto lower = [&](F8 cosine) {
    bounds[entry] = select(surface, bounds[entry] * cosine, bounds[entry]);
    ++entry;
  };
  for (const std::uint32_t root : roots_) {
    const V8 to_center = broadcast(tree_.center(root)) - p;
    lower(cosine_above(normal, to_center, sqrt(length_squared(to_center)), F8(std::sqrt(tree_.radius2(root)))));
  }
  for (const DistantEntry& light : distant_) {
    lower(cosine_above(normal, broadcast(light.direction), F8(1.0f), F8(light.radius)));
  }
  return bounds;
}

LightChoice::Visible8 LightChoice::visible(const V8& p, const LightVisibility& visibility) const {
  Visible8 out{!visibility.empty(), {}};
  if (out.known) {
    const U8 row = visibility.row(p);
    for (std::size_t i = 0; i < entries(); ++i) {
      out.of[i] = visibility.at(row, i);
    }
  }
  return out;
}

LightChoice::Entries8 LightChoice::probabilities(Entries8 bounds, const Visible8& visible) const {
  const F8 zero(0.0f);
  F8 sum(0.0f), shining(0.0f), visible_sum(0.0f);
  for (std::size_t i = 0; i < entries(); ++i) {
    sum += bounds[i];
    shining += masked(bounds[i] > zero, F8(1.0f));
    if (visible.known) {
      visible_sum += bounds[i] * visible.of[i];
    }
  }
  const F8 by_bound = F8(visible.known ? kBoundShare : 1 - kUniformShare) / sum, uniform = F8(kUniformShare) / shining;
  const F8 by_visible = visible.known ? F8(1 - kUniformShare - kBoundShare) / visible_sum : zero;
  for (std::size_t i = 0; i < entries(); ++i) {
    const F8 share = visible.known ? by_bound + visible.of[i] * by_visible : by_bound;
    bounds[i] = masked(bounds[i] > zero, bounds[i] * share + uniform);
  }
  return bounds;
}

LightChoice::Entries8 LightChoice::probabilities(const V8& p, const V8& normal,
                                                 const LightVisibility& visibility) const {
  return probabilities(above(p, normal, bounds(p)), visible(p, visibility));
}

LightChoice::Group8 LightChoice::group(U8 number) const {
  const U8 first = number * U8(group_size_);
  const U8 left = U8(static_cast<std::uint32_t>(count_ - bounded_)) - first;
  return {first, select(signed_less(left, U8(group_size_)), left, U8(group_size_))};
}

LightChoice::Choice8 LightChoice::sample(const V8& p, const V8& normal, Pair8 u) const {
  const Entries8 all = bounds(p);
  const Visible8 seen = visible(p, visibility_);
  const Entries8 at_point = probabilities(all, seen), here = probabilities(above(p, normal, all), seen);
  U8 entry(0u);
  F8 below(0.0f), below_entry(0.0f), pmf(0.0f), pmf_at_point(0.0f);
  for (std::size_t i = 0; i < entries(); ++i) {
    const M8 reached = (here[i] > F8(0.0f)) & (u.u >= below);  // the last one also takes what rounding leaves
    entry = select(reached, U8(static_cast<std::uint32_t>(i)), entry);
    below_entry = select(reached, below, below_entry);
    pmf = select(reached, here[i], pmf);
    pmf_at_point = select(reached, at_point[i], pmf_at_point);
    below += here[i];
  }
  const F8 rest = min((u.u - below_entry) / pmf, F8(1 - 0x1p-24f));
  const U8 roots(static_cast<std::uint32_t>(roots_.size()));
  const M8 near = signed_less(entry, roots);
  Choice8 out{U8(0u), F8(0.0f), F8(0.0f)};
  if (near.any()) {
    const U8 root = select(near, gather(roots_.data(), entry, near), U8(roots_.front()));
    const LightBvh::Choice8 chosen = tree_.sample(p, root, pmf_at_point, rest, u.v);
    out = {chosen.light, F8(0.0f), chosen.pmf};
  }
  if (const M8 far = ~near; far.any()) {
    const Group8 of = group(entry - roots);
    const U8 light = U8(static_cast<std::uint32_t>(bounded_)) + of.first + truncate(rest * to_float(of.size));
    out.light = select(near, out.light, light);
    out.pmf_at_point = select(near, out.pmf_at_point, pmf_at_point / to_float(of.size));
  }
  out.pmf = masked(pmf > F8(0.0f), out.pmf_at_point * (pmf / pmf_at_point));
  return out;
}

LightChoice::Choice8 LightChoice::sample_entry(std::size_t entry, const V8& p, Pair8 u) const {
  const F8 one(1.0f);
  if (entry < roots_.size()) {
    const LightBvh::Choice8 chosen = tree_.sample(p, U8(roots_[entry]), one, u.u, u.v);
    return {chosen.light, chosen.pmf, chosen.pmf};
  }
  const Group8 of = group(U8(static_cast<std::uint32_t>(entry - roots_.size())));
  const F8 pmf = one / to_float(of.size);
  return {U8(static_cast<std::uint32_t>(bounded_)) + of.first + truncate(u.u * to_float(of.size)), pmf, pmf};
}

F8 LightChoice::pmf(const V8& p, U8 light, M8 lanes) const {
  const Entries8 probability = probabilities(bounds(p), visible(p, visibility_));
  const U8 bounded(static_cast<std::uint32_t>(bounded_)), roots(static_cast<std::uint32_t>(roots_.size()));
  const M8 near = lanes & signed_less(light, bounded);
  const F8 per_group(1.0f / static_cast<float>(group_size_));
  const U8 number = truncate((to_float(light - bounded) + F8(0.5f)) * per_group);
  U8 entry = roots + number;
  if (near.any()) {
    entry = select(near, tree_.root_of(light, near), entry);
  }
  F8 of_entry(0.0f);
  for (std::size_t i = 0; i < entries(); ++i) {
    of_entry = select(entry == U8(static_cast<std::uint32_t>(i)), probability[i], of_entry);
  }
  F8 out = of_entry / to_float(group(number).size);
  if (near.any()) {
    out = select(near, tree_.pmf(p, light, gather(roots_.data(), entry, near), of_entry, near), out);
  }
  return masked(lanes, out);
}

}  // namespace lightmill
