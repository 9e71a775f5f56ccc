#include "common/materials/metals.h"

#include <numeric>

#include "common/materials/conductor.h"

namespace lightmill {
namespace {

constexpr std::array<Metal, 8> kMetals{{
    {"aluminium", {1.4204f, 0.9656f, 0.5897f}, {7.4674f, 6.4581f, 5.3107f}},
    {"chromium", {3.5348f, 2.9007f, 2.1448f}, {4.3476f, 4.2311f, 3.8623f}},
    {"copper", {0.2369f, 1.0046f, 1.2404f}, {3.6326f, 2.5831f, 2.3933f}},
    {"gold", {0.1548f, 0.4233f, 1.3828f}, {3.6074f, 2.4745f, 1.9154f}},
    {"iron", {2.9114f, 2.9497f, 2.5845f}, {3.0893f, 2.9318f, 2.7670f}},
    {"nickel", {2.0587f, 1.8145f, 1.6493f}, {3.7635f, 3.2587f, 2.6706f}},
    {"platinum", {2.3699f, 2.0908f, 1.8511f}, {4.2536f, 3.7037f, 3.1398f}},
    {"silver", {0.0521f, 0.0595f, 0.0400f}, {4.4132f, 3.5990f, 2.6492f}},
}};

}  // namespace

std::span<const Metal> metals() {
  return kMetals;
}

std::optional<Metal> find_metal(std::string_view name) {
  for (const Metal& metal : kMetals) {
    if (metal.name == name) {
      return metal;
    }
  }
  return std::nullopt;
}

Vec3 conductor::mean_fresnel(const Vec3& n, const Vec3& k) {
  constexpr int kSteps = 64;
  V8 sum;
  for (int i = 0; i < kSteps; i += 8) {
    // Equal steps of cos² θ.
    const F8 cos2 = (to_float(U8(static_cast<std::uint32_t>(i)) + U8::lane_index()) + F8(0.5f)) * F8(1.0f / kSteps);
    sum = sum + fresnel(sqrt(cos2), broadcast(n), broadcast(k));
  }
  const auto mean = [](F8 x) {
    alignas(32) float lanes[8];
    x.store(lanes);
    return std::accumulate(std::begin(lanes), std::end(lanes), 0.0f) / kSteps;
  };
  return {mean(sum.x), mean(sum.y), mean(sum.z)};
}

}  // namespace lightmill
