// Prints the tables of sheen.h as C++. This is a step of the build, so that no program computes them at its start.
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <fmt/format.h>

#include "common/materials/sheen_layout.h"
#include "common/materials/tabulate.h"

namespace lightmill::sheen {
namespace {

constexpr int kSteps = 160, kTurns = 64;  ///< quadrature points of directions

/// ∫ f(wo, wi) k(wi) |cos θi| dωi without k(wo), for k of the cosine. The points are finest near the horizon.
float integral(float cos_theta, float roughness, const std::function<float(float)>& k) {
  const F8 alpha(roughness * roughness);
  const float z = std::max(cos_theta, 1e-4f);
  const V8 wo{sqrt(F8(1.0f - z * z)), F8(0.0f), F8(z)};
  const F8 lambda_o = lambda(F8(z), alpha);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const float root = (static_cast<float>(i) + 0.5f) / kSteps, cosine = root * root;
    const F8 sine = sqrt(F8(1.0f - cosine * cosine));
    F8 ring;
    for (int j = 0; j < kTurns; j += 8) {
      // φ in [0, π]. The other half is its mirror image.
      const F8 turn = (to_float(U8(static_cast<std::uint32_t>(j)) + U8::lane_index()) + F8(0.5f)) * F8(0.5f / kTurns);
      const SinCos8 phi = sin_cos_turns(turn);
      ring += unlimited(wo, {sine * phi.cos, sine * phi.sin, F8(cosine)}, alpha, lambda_o);
    }
    sum += double{sum_of(ring)} * k(cosine) * 2 * root;
  }
  return static_cast<float>(sum * 2 * kPiDouble / (kSteps * kTurns));
}

/// The value of a row at a cosine, linear between its nodes.
float between(const float* row, float cos_theta) {
  const float at = std::sqrt(cos_theta) * (kAngles - 1);
  const int below = std::min(static_cast<int>(at), kAngles - 2);
  return row[below] + (row[below + 1] - row[below]) * (at - static_cast<float>(below));
}

std::string tables() {
  std::vector<float> limits, albedos, means;
  for (int r = 0; r < kRoughnesses; ++r) {
    const float roughness = kMinRoughness + (1 - kMinRoughness) * node(r, kRoughnesses);
    const auto cosine = [](int i) { return node(i, kAngles) * node(i, kAngles); };
    std::vector<float> limit, albedo;
    for (int i = 0; i < kAngles; ++i) {
      limit.push_back(1 / std::max(integral(cosine(i), roughness, [](float) { return 1.0f; }), 1.0f));
    }
    for (int i = 0; i < kAngles; ++i) {
      const float all = integral(cosine(i), roughness, [&](float c) { return between(limit.data(), c); });
      albedo.push_back(std::min(limit[static_cast<std::size_t>(i)] * all, 0.9999f));
    }
    double mean = 0;
    for (int i = 0; i < kSteps; ++i) {
      mean += double{between(albedo.data(), std::sqrt((static_cast<float>(i) + 0.5f) / kSteps))} / kSteps;
    }
    limits.insert(limits.end(), limit.begin(), limit.end());
    albedos.insert(albedos.end(), albedo.begin(), albedo.end());
    means.push_back(static_cast<float>(mean));
  }
  return array("kLimit", limits) + array("kAlbedo", albedos) + array("kMean", means);
}

}  // namespace
}  // namespace lightmill::sheen

int main() {
  fmt::print("{}", lightmill::sheen::tables());
  return 0;
}
