#include "common/lights/light_bvh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Largest depth, because a trail has one bit per level.
constexpr int kMaxDepth = 32;
constexpr int kBins = 12;
/// Rounding error of a cosine's bound. A node is skipped only if its bound is lower by more than this.
constexpr float kCosineRounding = 1e-4f;
/// Smallest cosine in a bound.
constexpr float kMinCosine = 0.02f;

double cosine_of_sum(double cos_a, double cos_b) {
  // a + b >= π where cos a <= −cos b, for angles in [0, π].
  return cos_a <= -cos_b ? -1 : cos_a * cos_b - std::sqrt(std::max((1 - cos_a * cos_a) * (1 - cos_b * cos_b), 0.0));
}

/// Bounds of both, with a cone about the mean of the axes that contains both cones.
LightBounds unite(const LightBounds& a, const LightBounds& b) {
  LightBounds out;
  out.low = glm::min(a.low, b.low);
  out.high = glm::max(a.high, b.high);
  out.power = a.power + b.power;
  out.intensity = a.intensity + b.intensity;
  out.two_sided = a.two_sided || b.two_sided;
  out.cos_emission = std::min(a.cos_emission, b.cos_emission);
  const Vec3d b_axis = out.two_sided && glm::dot(a.axis, b.axis) < 0 ? -b.axis : b.axis;
  const Vec3d sum = a.axis * a.power + b_axis * b.power;
  const double length = glm::length(sum);
  if (!(length > 1e-9 * out.power)) {
    return out;  // normals in all directions
  }
  out.axis = sum / length;
  const auto around = [&](const Vec3d& axis, double cos_normals) {
    return cosine_of_sum(std::clamp(glm::dot(out.axis, axis), -1.0, 1.0), cos_normals);
  };
  out.cos_normals = std::min(around(a.axis, a.cos_normals), around(b_axis, b.cos_normals));
  return out;
}

/// Cost of a node: power, extent and range of directions. The squared diagonal replaces the surface area, so that
/// lights in a row do not all cost the same.
double cost(const LightBounds& b) {
  const Vec3d size = b.high - b.low;
  const double directions = (1 - cosine_of_sum(b.cos_normals, b.cos_emission)) * (b.two_sided ? 2 : 1);
  return b.power * glm::dot(size, size) * directions;
}

Vec3d center_of(const LightBounds& b) {
  return (b.low + b.high) * 0.5;
}

}  // namespace

struct LightBvh::Builder {
  LightBvh& out;
  std::span<const LightBounds> lights;
  double unit;

  /// Adds the subtree of these lights. Returns its bounds.
  LightBounds build(std::span<std::uint32_t> some, int depth, std::uint32_t trail) {
    const auto node = static_cast<std::uint32_t>(out.intensity_.size());
    push_empty();
    LightBounds bounds;
    if (some.size() == 1) {
      bounds = lights[some[0]];
      out.light_[node] = some[0];
      out.trail_[some[0]] = trail;
    } else {
      const std::size_t middle = partition(some, depth);
      const LightBounds first = build(some.first(middle), depth + 1, trail);
      out.second_child_[node] = static_cast<std::uint32_t>(out.intensity_.size());
      bounds = unite(first, build(some.subspan(middle), depth + 1, trail | 1u << depth));
    }
    store(node, bounds);
    return bounds;
  }

  /// Moves the lights of the first child to the front. Returns their number.
  std::size_t partition(std::span<std::uint32_t> some, int depth) const {
    Vec3d low(std::numeric_limits<double>::infinity()), high(-low);
    for (const std::uint32_t i : some) {
      low = glm::min(low, center_of(lights[i]));
      high = glm::max(high, center_of(lights[i]));
    }
    // Halves the lights once the remaining bits of the trail just suffice.
    const bool must_halve = depth + std::bit_width(some.size()) >= kMaxDepth;
    double best = std::numeric_limits<double>::infinity();
    int best_axis = 0, best_bin = -1;
    for (int axis = 0; axis < 3 && !must_halve; ++axis) {
      find_split(some, axis, low[axis], high[axis], best, best_axis, best_bin);
    }
    if (best_bin < 0) {
      const Vec3d size = high - low;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const auto middle = some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2);
      std::nth_element(some.begin(), middle, some.end(), [&](std::uint32_t a, std::uint32_t b) {
        const double x = center_of(lights[a])[axis], y = center_of(lights[b])[axis];
        return x != y ? x < y : a < b;
      });
      return some.size() / 2;
    }
    const auto in_first = [&](std::uint32_t i) {
      return bin_of(center_of(lights[i])[best_axis], low[best_axis], high[best_axis]) <= best_bin;
    };
    return static_cast<std::size_t>(std::stable_partition(some.begin(), some.end(), in_first) - some.begin());
  }

  static int bin_of(double x, double low, double high) {
    return std::clamp(static_cast<int>(kBins * ((x - low) / (high - low))), 0, kBins - 1);
  }

  void find_split(std::span<const std::uint32_t> some, int axis, double low, double high, double& best, int& best_axis,
                  int& best_bin) const {
    if (!(high > low)) {
      return;
    }
    struct Bin {
      LightBounds bounds;
      bool used = false;
      void add(const LightBounds& b) {
        bounds = used ? unite(bounds, b) : b;
        used = true;
      }
    };
    std::array<Bin, kBins> bins, after;
    for (const std::uint32_t i : some) {
      bins[bin_of(center_of(lights[i])[axis], low, high)].add(lights[i]);
    }
    for (int i = kBins - 1; i > 0; --i) {
      after[i - 1] = i < kBins - 1 ? after[i] : Bin();
      if (bins[i].used) {
        after[i - 1].add(bins[i].bounds);
      }
    }
    Bin before;
    for (int i = 0; i + 1 < kBins; ++i) {
      if (bins[i].used) {
        before.add(bins[i].bounds);
      }
      if (!before.used || !after[i].used) {
        continue;
      }
      if (const double c = cost(before.bounds) + cost(after[i].bounds); c < best) {
        best = c;
        best_axis = axis;
        best_bin = i;
      }
    }
  }

  void push_empty() {
    out.center_.add(Vec3(0));
    out.axis_.add(Vec3(0));
    for (auto* array : {&out.radius2_, &out.cos_normals_, &out.sin_normals_, &out.cos_emission_, &out.intensity_}) {
      array->push_back(0);
    }
    for (auto* array : {&out.two_sided_, &out.second_child_, &out.light_}) {
      array->push_back(0);
    }
  }

  void store(std::uint32_t node, const LightBounds& b) {
    const Vec3d half = (b.high - b.low) * 0.5;
    out.center_.set(node, Vec3(center_of(b)));
    out.axis_.set(node, Vec3(b.axis));
    // Slightly larger, because the centre is rounded.
    out.radius2_[node] = static_cast<float>(glm::dot(half, half) * (1 + 1e-6));
    out.cos_normals_[node] = static_cast<float>(b.cos_normals);
    out.sin_normals_[node] = static_cast<float>(std::sqrt(std::max(1 - b.cos_normals * b.cos_normals, 0.0)));
    out.cos_emission_[node] = static_cast<float>(b.cos_emission);
    out.intensity_[node] = static_cast<float>(std::max(b.intensity / unit, kMinBound));
    out.two_sided_[node] = b.two_sided ? 1 : 0;
  }
};

LightBvh::LightBvh(std::span<const LightBounds> lights, double unit) {
  LM_CHECK(!lights.empty());
  for (const LightBounds& light : lights) {
    LM_CHECK(light.power > 0 && light.intensity > 0);
  }
  trail_.resize(lights.size());
  root_.resize(lights.size());
  std::vector<std::uint32_t> all(lights.size());
  std::iota(all.begin(), all.end(), 0u);
  Builder{*this, lights, unit}.build(all, 0, 0);
}

std::vector<std::uint32_t> LightBvh::cut(std::size_t most) {
  struct Subtree {
    std::uint32_t node;
    std::uint32_t end;  ///< of its nodes
    int depth;
  };
  std::vector<Subtree> subtrees{{0, static_cast<std::uint32_t>(intensity_.size()), 0}};
  const auto size = [&](const Subtree& s) {  // lights in one place are split by intensity
    return std::pair(is_leaf(s.node) ? -1.0f : radius2_[s.node] * intensity_[s.node], intensity_[s.node]);
  };
  while (subtrees.size() < most) {
    const auto largest = std::ranges::max_element(subtrees, {}, size);
    if (is_leaf(largest->node)) {
      break;
    }
    const Subtree whole = *largest;
    const std::uint32_t second = second_child_[whole.node];
    *largest = {whole.node + 1, second, whole.depth + 1};
    subtrees.push_back({second, whole.end, whole.depth + 1});
  }
  std::vector<std::uint32_t> roots;
  for (const Subtree& s : subtrees) {
    for (std::uint32_t node = s.node; node < s.end; ++node) {
      if (is_leaf(node)) {
        root_[light_[node]] = static_cast<std::uint32_t>(roots.size());
        trail_[light_[node]] >>= s.depth;
      }
    }
    roots.push_back(s.node);
  }
  return roots;
}

LightBvh::Cone LightBvh::emission_cone(std::uint32_t node) const {
  return {Vec3d(axis_[node]), two_sided_[node] == 1 ? -1 : cosine_of_sum(cos_normals_[node], cos_emission_[node])};
}

LightBvh::Node8 LightBvh::gathered(U8 node, M8 lanes) const {
  const auto row = [&](const std::vector<float>& rows) { return gather(rows.data(), node, lanes); };
  return {center_.at(node, lanes), axis_.at(node, lanes),
          row(radius2_),           row(cos_normals_),
          row(sin_normals_),       row(cos_emission_),
          row(intensity_),         gather(two_sided_.data(), node, lanes) == U8(1u)};
}

F8 LightBvh::bound(const V8& p, std::uint32_t node) const {
  return bound(p, {broadcast(center_[node]), broadcast(axis_[node]), F8(radius2_[node]), F8(cos_normals_[node]),
                   F8(sin_normals_[node]), F8(cos_emission_[node]), F8(intensity_[node]), M8(two_sided_[node] == 1)});
}

F8 LightBvh::bound(const V8& p, const Node8& node) {
  const V8 d = p - node.center;
  const F8 distance2 = length_squared(d);
  const M8 inside = distance2 <= node.radius2;
  const F8 one(1.0f), zero(0.0f);
  F8 cos_w = dot(node.axis, d) / sqrt(distance2);
  cos_w = max(min(cos_w, one), F8(-1.0f));
  cos_w = select(node.two_sided, abs(cos_w), cos_w);
  const F8 sin_w = sqrt(max(one - cos_w * cos_w, zero));
  // The angle w, minus the cone of normals and the angle that the bounds subtend.
  const M8 in_cone = cos_w >= node.cos_normals;
  const F8 cos_x = select(in_cone, one, cos_w * node.cos_normals + sin_w * node.sin_normals);
  const F8 sin_x = select(in_cone, zero, sin_w * node.cos_normals - cos_w * node.sin_normals);
  const F8 sin2_b = node.radius2 / distance2;
  const F8 sin_b = sqrt(sin2_b), cos_b = sqrt(max(one - sin2_b, zero));
  const M8 within = inside | (cos_x >= cos_b);
  const F8 cos_least = select(within, one, cos_x * cos_b + sin_x * sin_b);
  const M8 shines = cos_least > node.cos_emission - F8(kCosineRounding);
  // At the position of a point light the bound is infinite. Any finite number is as good.
  const F8 towards = node.intensity * max(cos_least, F8(kMinCosine));
  return masked(shines | inside, towards / max(max(distance2, node.radius2), F8(1e-30f)));
}

LightBvh::Split8 LightBvh::split(const V8& p, U8 node, U8 second, M8 lanes) const {
  const F8 a = bound(p, gathered(node + U8(1u), lanes));
  const F8 b = bound(p, gathered(second, lanes));
  const F8 sum = a + b;
  return {a / sum, lanes & (sum > F8(0.0f))};
}

LightBvh::Choice8 LightBvh::sample(const V8& p, U8 node, F8 pmf, F8 u, F8 more) const {
  const M8 all(true);
  M8 renewed(false);
  U8 second = gather(second_child_.data(), node, all);
  M8 inner = ~(second == U8(0u));
  while (inner.any()) {
    const Split8 s = split(p, node, second, inner);
    const M8 first = u < s.first;
    const F8 rest = F8(1.0f) - s.first;
    const F8 probability = select(first, s.first, rest);
    pmf = select(inner, masked(s.any, pmf * probability), pmf);
    u = select(inner, min(select(first, u / s.first, (u - s.first) / rest), F8(1 - 0x1p-24f)), u);
    const M8 used_up = and_not(pmf < F8(0x1p-12f), renewed);
    u = select(used_up, more, u);
    renewed = renewed | used_up;
    node = select(inner, select(first, node + U8(1u), second), node);
    second = gather(second_child_.data(), node, all);
    inner = inner & s.any & ~(second == U8(0u));
  }
  return {gather(light_.data(), node, all), pmf};
}

F8 LightBvh::pmf(const V8& p, U8 light, U8 node, F8 pmf, M8 lanes) const {
  U8 trail = gather(trail_.data(), light, lanes);
  U8 second = gather(second_child_.data(), node, lanes);
  M8 inner = and_not(lanes, second == U8(0u));
  while (inner.any()) {
    const Split8 s = split(p, node, second, inner);
    const M8 first = (trail & U8(1u)) == U8(0u);
    pmf = select(inner, masked(s.any, pmf * select(first, s.first, F8(1.0f) - s.first)), pmf);
    node = select(inner, select(first, node + U8(1u), second), node);
    trail = trail >> 1;
    second = gather(second_child_.data(), node, lanes);
    inner = inner & s.any & ~(second == U8(0u));
  }
  return masked(lanes, pmf);
}

}  // namespace lightmill
