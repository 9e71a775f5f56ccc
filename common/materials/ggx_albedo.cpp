#include "common/materials/ggx_albedo.h"

#include <algorithm>

#include "common/materials/ggx.h"

namespace lightmill {
namespace {

constexpr int kAngles = 33;              ///< nodes of √cos θ in [0, 1]
constexpr int kRoughnesses = 33;         ///< nodes of √α in [0, 1]
constexpr int kPhi = 32, kHeight = 128;  ///< quadrature points
constexpr float kLift = 0.002f;

F8 pow5(F8 x) {
  const F8 x2 = x * x;
  return x2 * x2 * x;
}

float sum_of(F8 x) {
  alignas(32) float lanes[8];
  x.store(lanes);
  float sum = 0;
  for (const float lane : lanes) {
    sum += lane;
  }
  return sum;
}

struct Terms {
  float normal, grazing;
};

/// Means over visible normals of G2/G1 · (1 − w) and G2/G1 · w.
Terms integrate(float cos_theta, float alpha) {
  const float z = std::max(cos_theta, 1e-4f);
  const V8 wo{sqrt(F8(1.0f - z * z)), F8(0.0f), F8(z)};
  if (alpha < ggx::kSmoothAlpha) {
    const float w = sum_of(pow5(F8(1.0f - z))) / 8;
    return {1 - w, w};
  }
  F8 normal, grazing;
  for (int i = 0; i < kHeight; ++i) {
    for (int j = 0; j < kPhi; j += 8) {
      // φ in [0, π]. The other half is its mirror image.
      const F8 phi = (to_float(U8(static_cast<std::uint32_t>(j)) + U8::lane_index()) + F8(0.5f)) * F8(0.5f / kPhi);
      const V8 m = ggx::sample_visible_normal(wo, F8(alpha), {phi, F8((static_cast<float>(i) + 0.5f) / kHeight)});
      const V8 wi = ggx::reflect(wo, m);
      const F8 weight = ggx::reflection_weight(wo, wi, F8(alpha));
      const F8 w = pow5(max(F8(1.0f) - dot(wo, m), F8(0.0f)));
      normal += weight * (F8(1.0f) - w);
      grazing += weight * w;
    }
  }
  return {sum_of(normal) / (kPhi * kHeight), sum_of(grazing) / (kPhi * kHeight)};
}

/// 2 ∫ E(μ) μ dμ of a row that is linear between nodes of t = √μ: ∫ 4 t³ E(t) dt, in closed form per segment.
float mean_of(const float* row) {
  double sum = 0;
  for (int i = 0; i + 1 < kAngles; ++i) {
    const double a = static_cast<double>(i) / (kAngles - 1), b = static_cast<double>(i + 1) / (kAngles - 1);
    const double slope = (row[i + 1] - row[i]) / (b - a);
    const double at_zero = row[i] - slope * a;
    sum += at_zero * (b * b * b * b - a * a * a * a) + slope * 0.8 * (b * b * b * b * b - a * a * a * a * a);
  }
  return static_cast<float>(sum);
}

/// The node below `t` in [0, 1], and the distance of t from it.
struct Place8 {
  U8 node;
  F8 rest;
};
Place8 place(F8 t, int nodes) {
  const F8 scaled = min(max(t, F8(0.0f)), F8(1.0f)) * F8(static_cast<float>(nodes - 1));
  const U8 node = truncate(min(scaled, F8(static_cast<float>(nodes) - 1.5f)));
  return {node, scaled - to_float(node)};
}

F8 interpolate(const std::vector<float>& table, const Place8& at) {
  const F8 a = gather(table.data(), at.node, M8(true));
  const F8 b = gather(table.data(), at.node + U8(1u), M8(true));
  return a + (b - a) * at.rest;
}

F8 interpolate(const std::vector<float>& table, const Place8& row, const Place8& column) {
  const U8 first = row.node * U8(static_cast<std::uint32_t>(kAngles)) + column.node;
  const F8 below = interpolate(table, {first, column.rest});
  const F8 above = interpolate(table, {first + U8(static_cast<std::uint32_t>(kAngles)), column.rest});
  return below + (above - below) * row.rest;
}

}  // namespace

const GgxAlbedo& GgxAlbedo::instance() {
  static const GgxAlbedo table;
  return table;
}

GgxAlbedo::GgxAlbedo() {
  for (int r = 0; r < kRoughnesses; ++r) {
    const float root_alpha = static_cast<float>(r) / (kRoughnesses - 1);
    float least = 1;
    for (int i = 0; i < kAngles; ++i) {
      const float root_cos = static_cast<float>(i) / (kAngles - 1);
      const Terms e = integrate(root_cos * root_cos, root_alpha * root_alpha);
      grazing_.push_back(std::min(e.grazing + kLift, 1.0f));
      normal_.push_back(std::min(e.normal * (1 + kLift), 1 - grazing_.back()));
      least = std::min(least, 0.04f * normal_.back() + grazing_.back());
    }
    mean_normal_.push_back(mean_of(&normal_[normal_.size() - kAngles]));
    mean_grazing_.push_back(mean_of(&grazing_[grazing_.size() - kAngles]));
    least_coat_.push_back(least);
  }
}

GgxAlbedo::Terms8 GgxAlbedo::directional(F8 cos_theta, F8 alpha) const {
  const Place8 row = place(sqrt(alpha), kRoughnesses);
  const Place8 column = place(sqrt(max(cos_theta, F8(0.0f))), kAngles);
  return {interpolate(normal_, row, column), interpolate(grazing_, row, column)};
}

GgxAlbedo::Terms8 GgxAlbedo::mean(F8 alpha) const {
  const Place8 row = place(sqrt(alpha), kRoughnesses);
  return {interpolate(mean_normal_, row), interpolate(mean_grazing_, row)};
}

F8 GgxAlbedo::least_coat(F8 alpha) const {
  return interpolate(least_coat_, place(sqrt(alpha), kRoughnesses));
}

}  // namespace lightmill
