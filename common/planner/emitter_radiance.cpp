#include "common/planner/emitter_radiance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "common/materials/ggx.h"

namespace lightmill {
namespace {

constexpr int kDraws = 256;  ///< light samples per position, or per light if all lights are sampled
constexpr int kPoints = 8;   ///< casters, or positions in them

/// Point `index` of a sequence in the four-dimensional unit cube: Roberts' R4, whose steps are powers of 1/φ, φ⁵ = φ +
/// 1.
std::array<float, 4> numbers(int index) {
  constexpr std::array kSteps{0.8566748838545029, 0.733891856627126, 0.6287067210378087, 0.5385972572236101};
  std::array<float, 4> out;
  for (std::size_t dimension = 0; dimension < 4; ++dimension) {
    const double x = (index + 0.5) * kSteps[dimension];
    out[dimension] = std::min(static_cast<float>(x - std::floor(x)), 0x1.fffffep-1f);
  }
  return out;
}

/// Eight of these points.
std::array<F8, 4> numbers_from(int first) {
  alignas(32) float values[4][8];
  for (int lane = 0; lane < 8; ++lane) {
    const std::array<float, 4> of_lane = numbers(first + lane);
    for (std::size_t dimension = 0; dimension < 4; ++dimension) {
      values[dimension][lane] = of_lane[dimension];
    }
  }
  return {F8::load(values[0]), F8::load(values[1]), F8::load(values[2]), F8::load(values[3])};
}

/// Light that arrives at a point, sampled as by next-event estimation, in eight lanes.
struct Arriving {
  std::vector<V8> direction, weight;  ///< weight 0: nothing was drawn
  std::vector<F8> pdf_solid_angle;    ///< 0 for lights without extent
};

Arriving draw(const CompiledScene& scene, const Vec3& at) {
  Arriving out;
  for (std::uint32_t draw = 0; draw < scene.lights().draws(); ++draw) {
    for (int i = 0; i < kDraws; i += 8) {
      const auto [a, b, c, d] = numbers_from(i);
      const LightSample8 drawn = scene.lights().sample(broadcast(at), draw, {a, b}, {c, d});
      const F8 sum = drawn.weight.x + drawn.weight.y + drawn.weight.z;
      const M8 there = drawn.valid & (sum < F8(std::numeric_limits<float>::infinity()));
      out.direction.push_back(drawn.wi);
      out.weight.push_back(masked(there, drawn.weight));
      out.pdf_solid_angle.push_back(drawn.pdf_solid_angle);
    }
  }
  return out;
}

float sum_of(F8 values) {
  alignas(32) float lanes[8];
  values.store(lanes);
  return std::accumulate(lanes, lanes + 8, 0.0f);
}

/// Radiance of the arriving light in one direction, blurred by the lobe.
///
/// A lobe of GGX with a small alpha scatters light from the angle δ off its mirror direction. Half vectors are then δ/2
/// off the normal, and the density per solid angle is K(δ) = (1 + tan²(δ/2)/alpha²)^−2 / (4π alpha²). All mirror
/// directions are equally likely, so their radiance-weighted mean radiance is blurred by K twice. That is a blur with
/// √3 alpha: its peak is ∫ K² = 1/(12π alpha²), and its integral 1.
Vec3 blurred(const Arriving& light, const Vec3& direction, float alpha) {
  const float wide2 = 3 * alpha * alpha;
  const V8 towards = broadcast(direction);
  V8 sum = broadcast(Vec3{0});
  for (std::size_t i = 0; i < light.weight.size(); ++i) {
    const F8 cosine = dot(light.direction[i], towards);
    const F8 tan2 = max(F8(1.0f) - cosine, F8(0.0f)) / max(F8(1.0f) + cosine, F8(1e-6f));
    const F8 falloff = F8(1.0f) + tan2 / F8(wide2);
    sum = sum + light.weight[i] * (F8(1.0f) / (falloff * falloff));
  }
  return Vec3{sum_of(sum.x), sum_of(sum.y), sum_of(sum.z)} / (4 * kPi * wide2 * kDraws);
}

struct RadianceSums {
  std::array<double, 3> arriving{}, weighted{};
};

void add(const Arriving& light, const CasterLobe& lobe, RadianceSums& sums) {
  const auto alpha = static_cast<float>(lobe.alpha);
  for (std::size_t i = 0; i < light.weight.size(); ++i) {
    const VectorLanes directions(light.direction[i]), weights(light.weight[i]);
    alignas(32) float pdfs[8];
    light.pdf_solid_angle[i].store(pdfs);
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3 weight(weights[lane]);
      const Vec3 radiance = weight * pdfs[lane];
      // The blurred radiance is at most the light's own, because few samples, or only this one, fall in a narrow lobe.
      Vec3 shown = radiance;
      if (alpha >= ggx::kSmoothAlpha && weight != Vec3{0}) {
        shown = blurred(light, Vec3(directions[lane]), alpha);
        shown = pdfs[lane] > 0 ? glm::min(shown, radiance) : shown;
      }
      for (int channel = 0; channel < 3; ++channel) {
        const auto at = static_cast<std::size_t>(channel);
        sums.arriving[at] += lobe.share * static_cast<double>(weight[channel]);
        sums.weighted[at] += lobe.share * static_cast<double>(weight[channel]) * static_cast<double>(shown[channel]);
      }
    }
  }
}

/// The casters to evaluate, chosen by size. Infinite ones count as large as the scene.
std::vector<std::size_t> chosen_casters(const CausticTargets& targets) {
  std::vector<double> up_to;  // sums of squared radii
  for (const BoundingSphere& caster : targets.casters) {
    const double radius = std::isfinite(caster.radius) ? caster.radius : targets.scene.radius;
    up_to.push_back((up_to.empty() ? 0 : up_to.back()) + radius * radius);
  }
  std::vector<std::size_t> out;
  for (int i = 0; i < kPoints; ++i) {
    const auto found = std::ranges::upper_bound(up_to, up_to.back() * (i + 0.5) / kPoints);
    out.push_back(std::min(static_cast<std::size_t>(found - up_to.begin()), up_to.size() - 1));
  }
  return out;
}

}  // namespace

Vec3 emitter_radiance_in_casters(const CompiledScene& scene) {
  const CausticTargets& targets = scene.caustic_targets();
  if (scene.lights().empty() || targets.casters.empty()) {
    return Vec3{0};
  }
  RadianceSums sums;
  int point = 0;
  for (const std::size_t caster : chosen_casters(targets)) {
    const BoundingSphere& around =
        std::isfinite(targets.casters[caster].radius) ? targets.casters[caster] : targets.scene;
    // Half the size, so that the position is not in a light beside it.
    const std::array<float, 4> u = numbers(point++);
    const Vec3d offset = (Vec3d(u[0], u[1], u[2]) - 0.5) * around.radius;
    const Arriving light = draw(scene, Vec3(around.center + offset));
    for (const CasterLobe& lobe : targets.lobes[caster]) {
      add(light, lobe, sums);
    }
  }
  Vec3 out{0};
  for (int channel = 0; channel < 3; ++channel) {
    const auto at = static_cast<std::size_t>(channel);
    out[channel] = sums.arriving[at] > 0 ? static_cast<float>(sums.weighted[at] / sums.arriving[at]) : 0;
  }
  return out;
}

}  // namespace lightmill
