#include "common/planner/lamp_radiance.h"

#include <array>
#include <cmath>

namespace lightmill {
namespace {

/// Eight points of the unit cube in four dimensions, from number `first` on: Roberts' R4 sequence, whose steps are
/// powers of 1/φ, φ⁵ = φ + 1.
std::array<F8, 4> numbers_from(int first) {
  constexpr std::array kSteps{0.8566748838545029, 0.733891856627126, 0.6287067210378087, 0.5385972572236101};
  std::array<F8, 4> out;
  for (std::size_t dimension = 0; dimension < 4; ++dimension) {
    alignas(32) float values[8];
    for (int lane = 0; lane < 8; ++lane) {
      const double x = (first + lane + 0.5) * kSteps[dimension];
      values[lane] = std::min(static_cast<float>(x - std::floor(x)), 0x1.fffffep-1f);
    }
    out[dimension] = F8::load(values);
  }
  return out;
}

void add(F8 values, double& sum) {
  alignas(32) float lanes[8];
  values.store(lanes);
  for (const float value : lanes) {
    sum += std::isfinite(value) ? static_cast<double>(value) : 0;
  }
}

}  // namespace

Vec3 lamp_radiance(const CompiledScene& scene) {
  constexpr int kPoints = 5, kDraws = 1024;
  if (scene.lights().empty()) {
    return Vec3{0};
  }
  std::array<double, 3> arriving{}, weighted{};
  for (int point = 0; point < kPoints; ++point) {
    const V8 p = broadcast(scene.camera().eye * (1 - static_cast<float>(point) / (kPoints - 1)));
    for (int first = 0; first < kDraws; first += 8) {
      const auto [a, b, c, d] = numbers_from(first);
      const LightSample8 drawn = scene.lights().sample(p, {a, b}, {c, d});
      const V8 weight = masked(drawn.valid, drawn.weight), radiance = weight * drawn.pdf_solid_angle;
      add(weight.x, arriving[0]);
      add(weight.y, arriving[1]);
      add(weight.z, arriving[2]);
      add(weight.x * radiance.x, weighted[0]);
      add(weight.y * radiance.y, weighted[1]);
      add(weight.z * radiance.z, weighted[2]);
    }
  }
  Vec3 out{0};
  for (int channel = 0; channel < 3; ++channel) {
    const auto at = static_cast<std::size_t>(channel);
    out[channel] = arriving[at] > 0 ? static_cast<float>(weighted[at] / arriving[at]) : 0;
  }
  return out;
}

}  // namespace lightmill
