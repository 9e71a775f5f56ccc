#include "common/lights/equiangular.h"

#include <cmath>

#include "common/lights/light_bvh.h"
#include "common/math/exp_log.h"
#include "common/math/transcendental.h"

namespace lightmill {
namespace {

/// Segments end for clusters after this many reaches. The rest of the density covers what lies beyond.
constexpr float kReaches = 8;
/// Transmittance over more reaches counts as that over this many, so that far lights do not vanish by rounding.
constexpr float kMostReaches = 20;
/// Least probability of the rest. It bounds the weights of samples where lights are occluded.
constexpr float kLeastRest = 0.2f;
/// Largest share of directions that are aimed at clusters. Weights of the others are at most 1 / (1 − this).
constexpr float kAimed = 0.25f;

struct Interval8 {
  F8 first, last;
};

/// The part of [0, end] of a ray in a cone with an angle of at most 90°. Empty if `last` is not above `first`.
Interval8 clip_to_cone(const V8& from_apex, const V8& direction, const V8& axis, float cos_cone, F8 end) {
  const F8 zero(0.0f), c2(cos_cone * cos_cone);
  // In the cone (v + td)·axis >= cos |v + td|. Squared: at² + 2bt + c >= 0, on the side of the axis.
  const F8 v = dot(from_apex, axis), d = dot(direction, axis);
  const F8 a = d * d - c2, b = v * d - c2 * dot(from_apex, direction), c = v * v - c2 * length_squared(from_apex);
  const F8 root = sqrt(max(b * b - a * c, zero));
  const F8 q = -(b + copysign(root, b));
  const F8 one = q / a, other = c / q;
  const F8 low = min(one, other), high = max(one, other);
  const M8 crosses = a < zero;  // the ray is steeper than the cone, and leaves it again
  const M8 misses = crosses & ((b * b < a * c) | (v + d * (low + high) * F8(0.5f) < zero));
  const M8 outwards = d > zero;
  F8 first = select(crosses, low, select(outwards, high, zero));
  F8 last = select(crosses, high, select(outwards, end, low));
  first = max(first, zero);
  last = min(last, end);
  return {first, select(misses, zero, last)};
}

}  // namespace

EquiangularLights::EquiangularLights(std::span<const LightBounds> bounded, std::span<const DistantBounds> distant) {
  double unit = 0, irradiance = 0;
  for (const LightBounds& light : bounded) {
    unit += light.intensity;
  }
  for (const DistantBounds& light : distant) {
    irradiance += light.irradiance;
  }
  if (bounded.empty()) {
    return;
  }
  distant_ = static_cast<float>(irradiance / unit);
  LightBvh tree(bounded, unit);
  for (const std::uint32_t root : tree.cut(kMaxClusters)) {
    const LightBvh::Cone cone = tree.emission_cone(root);
    const Vec3 center = tree.center(root);
    const double sine = std::sqrt(std::max(1 - cone.cosine * cone.cosine, 1e-6));
    clusters_.push_back({center, tree.radius2(root), tree.intensity(root),
                         Vec3(Vec3d(center) - cone.axis * (std::sqrt(double{tree.radius2(root)}) / sine)),
                         Vec3(cone.axis), static_cast<float>(cone.cosine), cone.cosine >= 0});
  }
}

F8 EquiangularLights::nearest2(const V8& point) const {
  F8 nearest(std::numeric_limits<float>::infinity());
  for (const Cluster& cluster : clusters_) {
    const F8 to_center2 = length_squared(broadcast(cluster.center) - point);
    nearest = min(nearest, masked(to_center2 > F8(cluster.radius2), to_center2));
  }
  return nearest;
}

EquiangularLights::Span8 EquiangularLights::span(const Cluster& cluster, const V8& origin, const V8& direction,
                                                 F8 end) const {
  const V8 to_center = broadcast(cluster.center) - origin;
  Span8 out;
  out.middle = dot(to_center, direction);
  // Light falls off more slowly within the cluster. The last term bounds rounding errors.
  const F8 height2 = length_squared(to_center - direction * out.middle) + F8(0.25f * cluster.radius2);
  out.height = sqrt(max(height2, F8(1e-12f) * length_squared(to_center) + F8(1e-30f)));
  Interval8 lit{F8(0.0f), end};
  if (cluster.in_cone) {
    lit = clip_to_cone(origin - broadcast(cluster.apex), direction, broadcast(cluster.axis), cluster.cos_cone, end);
  }
  out.first = lit.first;
  out.last = lit.last;
  const F8 x0 = out.first - out.middle, x1 = out.last - out.middle;
  out.angle = atan2(out.height * (x1 - x0), out.height * out.height + x0 * x1);
  out.probability = masked((out.last > out.first) & (out.angle > F8(0.0f)), F8(1.0f));
  return out;
}

/// The probability of a cluster follows the light that its part of the segment gets: intensity · angle / height, times
/// the transmittance along the way over the nearest point. Where transmittance falls faster than the light, a density
/// that follows transmittance is better, so the rest gets this share.
EquiangularLights::Mixture8 EquiangularLights::mixture(const V8& origin, const V8& direction, F8 length,
                                                       F8 reach) const {
  const F8 zero(0.0f), one(1.0f);
  Mixture8 out;
  out.size = clusters_.size();
  const F8 end = min(length, reach * F8(kReaches)), per_reach = one / reach;
  F8 sum(0.0f), rest = F8(distant_) * reach;
  for (std::size_t i = 0; i < out.size; ++i) {
    Span8& span = out.spans[i];
    span = this->span(clusters_[i], origin, direction, end);
    const F8 nearest = min(max(span.middle, span.first), span.last), x = nearest - span.middle;
    const F8 distance = sqrt(span.height * span.height + x * x);
    const F8 light = masked(span.probability > zero, F8(clusters_[i].intensity) * span.angle / span.height *
                                                         exp(-min((nearest + distance) * per_reach, F8(kMostReaches))));
    span.probability = light * (reach / (reach + distance));
    sum += span.probability;
    rest += light - span.probability;
  }
  const F8 all = sum + rest;
  const F8 scale = masked(all > F8(1e-30f), F8(1 - kLeastRest) / all);
  out.rest = one;
  for (std::size_t i = 0; i < out.size; ++i) {
    out.spans[i].probability = out.spans[i].probability * scale;
    out.rest = out.rest - out.spans[i].probability;
  }
  return out;
}

/// A cluster's probability follows the light that segments past it get, where it is near.
EquiangularLights::Aim8 EquiangularLights::aim(const V8& point, F8 reach) const {
  const F8 per_reach = F8(1.0f) / reach;
  Aim8 out;
  out.size = clusters_.size();
  F8 sum(0.0f);
  for (std::size_t i = 0; i < out.size; ++i) {
    const Cluster& cluster = clusters_[i];
    const V8 to_center = broadcast(cluster.center) - point;
    const F8 distance2 = length_squared(to_center), distance = sqrt(distance2);
    const M8 outside = distance2 > F8(cluster.radius2);
    const F8 light = masked(outside, F8(cluster.intensity) / distance);
    out.parts[i] = {select(outside, to_center * (F8(1.0f) / distance), broadcast(Vec3(0, 0, 1))),
                    light * exp(-min(distance * per_reach, F8(kMostReaches)))};
    sum += light;
  }
  const F8 scale = masked(sum > F8(1e-30f), F8(kAimed) / sum);
  out.rest = F8(1.0f);
  for (std::size_t i = 0; i < out.size; ++i) {
    out.parts[i].probability = out.parts[i].probability * scale;
    out.rest = out.rest - out.parts[i].probability;
  }
  return out;
}

F8 EquiangularLights::Aim8::pdf_solid_angle(const V8& wi) const {
  constexpr float kLeastSine = 1e-6f;  // single precision knows no smaller angle
  F8 pdf(0.0f);
  for (std::size_t i = 0; i < size; ++i) {
    const F8 sine = sqrt(length_squared(cross(parts[i].axis, wi)));
    pdf += parts[i].probability * F8(0.5f * kInvPi * kInvPi) / max(sine, F8(kLeastSine));
  }
  return pdf;
}

V8 EquiangularLights::Aim8::sample(Pair8 u) const {
  F8 below = rest;
  Part8 drawn{broadcast(Vec3(0, 0, 1)), F8(1.0f)};
  F8 from(0.0f);
  for (std::size_t i = 0; i < size; ++i) {
    const M8 reached = (parts[i].probability > F8(0.0f)) & (u.u >= below);
    drawn.axis = select(reached, parts[i].axis, drawn.axis);
    drawn.probability = select(reached, parts[i].probability, drawn.probability);
    from = select(reached, below, from);
    below += parts[i].probability;
  }
  const F8 share = min((u.u - from) / drawn.probability, F8(1.0f));
  const SinCos8 theta = sin_cos_turns(share * F8(0.5f)), phi = sin_cos_turns(u.v);
  return Frame8(drawn.axis).to_world({theta.sin * phi.cos, theta.sin * phi.sin, theta.cos});
}

F8 EquiangularLights::Span8::sample(F8 u) const {
  // tan(θ0 + uθ) with tan θ0 = x0 / height.
  const SinCos8 turn = sin_cos_turns(u * angle * F8(0.5f * kInvPi));
  const F8 x0 = first - middle;
  const F8 x = height * (x0 * turn.cos + height * turn.sin) / (height * turn.cos - x0 * turn.sin);
  return min(max(middle + x, first), last);
}

F8 EquiangularLights::Mixture8::pdf_length(F8 distance) const {
  F8 pdf(0.0f);
  for (std::size_t i = 0; i < size; ++i) {
    pdf += masked(spans[i].probability > F8(0.0f), spans[i].probability * spans[i].pdf_length(distance));
  }
  return pdf;
}

F8 EquiangularLights::Mixture8::sample(Pair8 u) const {
  F8 below = rest;
  Span8 drawn{};
  for (std::size_t i = 0; i < size; ++i) {
    // The last one also takes what rounding leaves.
    const M8 reached = (spans[i].probability > F8(0.0f)) & (u.u >= below);
    drawn.middle = select(reached, spans[i].middle, drawn.middle);
    drawn.height = select(reached, spans[i].height, drawn.height);
    drawn.first = select(reached, spans[i].first, drawn.first);
    drawn.last = select(reached, spans[i].last, drawn.last);
    drawn.angle = select(reached, spans[i].angle, drawn.angle);
    below += spans[i].probability;
  }
  return drawn.sample(u.v);
}

}  // namespace lightmill
