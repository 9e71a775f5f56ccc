// Prints the tables of ggx_albedo.h as C++. This is a step of the build, so that no program computes them at its start.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "common/materials/dielectric.h"
#include "common/materials/ggx.h"
#include "common/materials/ggx_albedo.h"
#include "common/materials/ggx_layout.h"
#include "common/materials/tabulate.h"

namespace lightmill::ggx {
namespace {

constexpr int kPhi = 32, kHeight = 128;                       ///< quadrature points of visible normals
constexpr std::uint32_t kLattice = 1600, kLatticeStep = 987;  ///< the same for glass
constexpr float kMost = 0.9999f;                              ///< the largest albedo of gloss
constexpr float kFullContrast = 0.09f;  ///< (eta − 1)/(eta + 1) from which glass is compensated in full: eta = 1.2

F8 pow5(F8 x) {
  const F8 x2 = x * x;
  return x2 * x2 * x;
}

V8 seen_from(float cos_theta) {
  const float z = std::max(cos_theta, 1e-4f);
  return {sqrt(F8(1.0f - z * z)), F8(0.0f), F8(z)};
}

/// Calls `add` with eight normals visible from `wo` at a time. All have equal probability.
void for_each_visible_normal(const V8& wo, float alpha, const std::function<void(const V8&)>& add) {
  for (int i = 0; i < kHeight; ++i) {
    for (int j = 0; j < kPhi; j += 8) {
      // φ in [0, π]. The other half is its mirror image.
      const F8 phi = (to_float(U8(static_cast<std::uint32_t>(j)) + U8::lane_index()) + F8(0.5f)) * F8(0.5f / kPhi);
      add(sample_visible_normal(wo, F8(alpha), {phi, F8((static_cast<float>(i) + 0.5f) / kHeight)}));
    }
  }
}

/// The same with kLattice normals of a Fibonacci lattice.
void for_each_lattice_normal(const V8& wo, const Alpha8& alpha, const std::function<void(const V8&)>& add) {
  for (std::uint32_t i = 0; i < kLattice; i += 8) {
    alignas(32) float phi[8], height[8];
    for (std::uint32_t lane = 0; lane < 8; ++lane) {
      phi[lane] = static_cast<float>((i + lane) * kLatticeStep % kLattice) / kLattice;
      height[lane] = (static_cast<float>(i + lane) + 0.5f) / kLattice;
    }
    add(sample_visible_normal(wo, alpha, {F8::load(phi), F8::load(height)}));
  }
}

struct Terms {
  float normal, grazing;
};

/// Means over visible normals of G2/G1 · (1 − w) and G2/G1 · w.
Terms schlick_terms(float cos_theta, float alpha) {
  const V8 wo = seen_from(cos_theta);
  if (alpha < kSmoothAlpha) {
    const float w = sum_of(pow5(F8(1.0f) - wo.z)) / 8;
    return {1 - w, w};
  }
  F8 normal, grazing;
  for_each_visible_normal(wo, alpha, [&](const V8& m) {
    const F8 weight = reflection_weight(wo, reflect(wo, m), F8(alpha));
    const F8 w = pow5(max(F8(1.0f) - dot(wo, m), F8(0.0f)));
    normal += weight * (F8(1.0f) - w);
    grazing += weight * w;
  });
  return {sum_of(normal) / (kPhi * kHeight), sum_of(grazing) / (kPhi * kHeight)};
}

/// The albedo of dielectric facets.
float gloss(float cos_theta, float alpha, float eta) {
  const V8 wo = seen_from(cos_theta);
  if (alpha < kSmoothAlpha) {
    return first_of(dielectric::fresnel(wo.z, F8(eta)).reflectance);
  }
  F8 sum;
  for_each_visible_normal(wo, alpha, [&](const V8& m) {
    const F8 cosine = min(max(dot(wo, m), F8(0.0f)), F8(1.0f));
    sum += reflection_weight(wo, reflect(wo, m), F8(alpha)) * dielectric::fresnel(cosine, F8(eta)).reflectance;
  });
  return sum_of(sum) / (kPhi * kHeight);
}

/// The index of a node of `gloss_index_coordinate`, by bisection of (eta − 1)/(eta + 1). The last one stands for a mirror.
float gloss_eta(int i) {
  double low = 0, high = 0.999;
  const auto eta = [](double contrast) { return static_cast<float>((1 + contrast) / (1 - contrast)); };
  for (int step = 0; step < 40; ++step) {
    const double middle = (low + high) / 2;
    (first_of(gloss_index_coordinate(F8(eta(middle)))) < node(i, kGlossIndices) ? low : high) = middle;
  }
  return eta(high);
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

/// The cosines of the nodes of `direction_coordinate`, by bisection.
std::vector<float> node_cosines() {
  std::vector<float> cosines;
  for (int i = 0; i < kAngles; ++i) {
    float low = 0, high = 1;
    for (int step = 0; step < 40; ++step) {
      const float middle = (low + high) / 2;
      (first_of(direction_coordinate(F8(middle))) < node(i, kAngles) ? low : high) = middle;
    }
    cosines.push_back(i == 0 ? 0 : high);
  }
  return cosines;
}

/// Scattering between the nodes of directions: angles on one or two sides, or angles and azimuths. Row i of `shares_`
/// divides the uniform light that node i sees among the nodes j from which it comes. Between nodes the factors are
/// linear.
class Scattering {
 public:
  explicit Scattering(int sides) : size_(kAngles * sides), shares_(static_cast<std::size_t>(size_ * size_)) {}
  static Scattering with_azimuths() { return Scattering(kAzimuths); }

  /// Adds light to the node `from` that comes from these cosines on the side.
  void add(int from, int side, F8 cosine, F8 weight) {
    alignas(32) float place[8], share[8];
    (direction_coordinate(cosine) * F8(static_cast<float>(kAngles - 1))).store(place);
    weight.store(share);
    double* row = &shares_[static_cast<std::size_t>(from * size_ + side * kAngles)];
    for (int lane = 0; lane < 8; ++lane) {
      const int below = std::min(static_cast<int>(place[lane]), kAngles - 2);
      const double rest = static_cast<double>(place[lane]) - below;
      row[below] += share[lane] * (1 - rest);
      row[below + 1] += share[lane] * rest;
    }
  }

  /// Adds light to the node `from` that comes from these directions. Nodes are angle · kAzimuths + azimuth.
  void add(int from, const V8& directions, F8 weight) {
    alignas(32) float angle[8], azimuth[8], share[8];
    (direction_coordinate(directions.z) * F8(static_cast<float>(kAngles - 1))).store(angle);
    (azimuth_coordinate(directions) * F8(static_cast<float>(kAzimuths - 1))).store(azimuth);
    weight.store(share);
    double* row = &shares_[static_cast<std::size_t>(from * size_)];
    for (int lane = 0; lane < 8; ++lane) {
      const int a = std::min(static_cast<int>(angle[lane]), kAngles - 2);
      const int b = std::min(static_cast<int>(azimuth[lane]), kAzimuths - 2);
      const double s = static_cast<double>(angle[lane]) - a, t = static_cast<double>(azimuth[lane]) - b;
      double* cell = row + a * kAzimuths + b;
      cell[0] += share[lane] * (1 - s) * (1 - t);
      cell[1] += share[lane] * (1 - s) * t;
      cell[kAzimuths] += share[lane] * s * (1 - t);
      cell[kAzimuths + 1] += share[lane] * s * t;
    }
  }

  /// The share of uniform light that each node sees.
  std::vector<double> seen() const {
    std::vector<double> sums;
    for (std::size_t i = 0; i < shares_.size(); i += static_cast<std::size_t>(size_)) {
      sums.push_back(std::accumulate(&shares_[i], &shares_[i] + size_, 0.0));
    }
    return sums;
  }

  /// Factors g with which each node sees the wanted share: g[i] Σ_j shares[i][j] g[j] = wanted[i].
  std::vector<double> balance(const std::vector<double>& wanted) const {
    std::vector<double> g(wanted.size(), 1.0);
    for (double worst = 1; worst > 5e-4;) {
      const std::vector<double> before = g;
      worst = 0;
      for (std::size_t i = 0; i < g.size(); ++i) {
        const double now = std::inner_product(before.begin(), before.end(), &shares_[i * g.size()], 0.0);
        worst = std::max(worst, std::abs(before[i] * now - wanted[i]));
        // The geometric mean of this factor and of the factor that fits the others. The latter alone oscillates.
        g[i] = std::sqrt(before[i] * wanted[i] / now);
      }
    }
    return g;
  }

 private:
  int size_;
  std::vector<double> shares_;
};

Scattering metal(const std::vector<float>& cosines, float alpha) {
  Scattering all(1);
  for (int i = 0; i < kAngles; ++i) {
    const V8 wo = seen_from(cosines[static_cast<std::size_t>(i)]);
    for_each_visible_normal(wo, alpha, [&](const V8& m) {
      const V8 wi = reflect(wo, m);
      all.add(i, 0, max(wi.z, F8(0.0f)), reflection_weight(wo, wi, F8(alpha)) * F8(1.0f / (kPhi * kHeight)));
    });
  }
  return all;
}

const std::vector<double> kAll(kAngles, 1.0);  ///< wanted of white metal

/// Factors that compensate for this part of the lost light. First the side from which the index behind the surface is
/// `eta`, then the other one.
std::vector<double> balanced_glass(const std::vector<float>& cosines, float alpha, float eta, double part) {
  constexpr float kShare = 1.0f / kLattice;
  Scattering all(2);
  for (const int side : {0, 1}) {
    const F8 index = side == 0 ? F8(eta) : F8(1.0f) / F8(eta);
    for (int i = 0; i < kAngles; ++i) {
      const V8 wo = seen_from(cosines[static_cast<std::size_t>(i)]);
      for_each_lattice_normal(wo, F8(alpha), [&](const V8& m) {
        const F8 cos_o = min(max(dot(wo, m), F8(0.0f)), F8(1.0f));
        const dielectric::Fresnel8 f = dielectric::fresnel(cos_o, index);
        const V8 back = reflect(wo, m);
        const V8 through = m * (cos_o / index - f.cos_refracted) - wo * (F8(1.0f) / index);
        const F8 depth = max(-through.z, F8(0.0f));
        const F8 passed = masked(depth > F8(0.0f), masking_over_cos(through, F8(alpha)) * depth);
        const int from = side * kAngles + i;
        all.add(from, side, max(back.z, F8(0.0f)), f.reflectance * reflection_weight(wo, back, F8(alpha)) * F8(kShare));
        all.add(from, 1 - side, depth, (F8(1.0f) - f.reflectance) * passed * F8(kShare));
      });
    }
  }
  std::vector<double> wanted;
  for (const double seen : all.seen()) {
    wanted.push_back(seen + part * (1 - seen));
  }
  return all.balance(wanted);
}

/// Tables of facets of one roughness and one anisotropy, by angle and azimuth.
struct Anisotropic {
  std::vector<float> white, coat;  ///< albedos of facets that reflect all, and with the index of coats
  std::vector<float> balance;
};

/// A direction with this cosine and `azimuth_coordinate`.
V8 seen_from(float cos_theta, float azimuth) {
  const V8 w = seen_from(cos_theta);
  const float length = std::sqrt((1 - azimuth) * (1 - azimuth) + azimuth * azimuth);
  return {w.x * F8((1 - azimuth) / length), w.x * F8(azimuth / length), w.z};
}

/// Mean of a table by angle and azimuth over the hemisphere, weighted by cos θ. Midpoint rule.
float mean_of_azimuths(const std::vector<float>& values) {
  constexpr int kSteps = 64;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine = std::sqrt((i + 0.5) / kSteps);  // even in cos²
    const float angle = first_of(direction_coordinate(F8(static_cast<float>(cosine)))) * (kAngles - 1);
    const int a = std::min(static_cast<int>(angle), kAngles - 2);
    for (int j = 0; j < kSteps; ++j) {
      const double phi = kPiDouble / 2 * (j + 0.5) / kSteps, x = cos_fixed(phi), y = sin_fixed(phi);
      const double azimuth = y / (x + y) * (kAzimuths - 1);
      const int b = std::min(static_cast<int>(azimuth), kAzimuths - 2);
      const double s = static_cast<double>(angle) - a, t = azimuth - b;
      const float* cell = &values[static_cast<std::size_t>(a * kAzimuths + b)];
      sum += (cell[0] * (1 - t) + cell[1] * t) * (1 - s) + (cell[kAzimuths] * (1 - t) + cell[kAzimuths + 1] * t) * s;
    }
  }
  return static_cast<float>(sum / (kSteps * kSteps));
}

Anisotropic anisotropic(const std::vector<float>& cosines, float roughness, float anisotropy) {
  const float y = std::max(roughness * roughness, kSmoothAlpha), x = y + (1 - y) * anisotropy * anisotropy;
  const Alpha8 alpha{F8(x), F8(y)};
  Scattering all = Scattering::with_azimuths();
  Anisotropic out;
  for (int i = 0; i < kAngles * kAzimuths; ++i) {
    const V8 wo = seen_from(cosines[static_cast<std::size_t>(i / kAzimuths)], node(i % kAzimuths, kAzimuths));
    F8 white, coat;
    for_each_lattice_normal(wo, alpha, [&](const V8& m) {
      const V8 wi = reflect(wo, m);
      const F8 weight = reflection_weight(wo, wi, alpha) * F8(1.0f / kLattice);
      white += weight;
      coat += weight * dielectric::fresnel(min(max(dot(wo, m), F8(0.0f)), F8(1.0f)), F8(kCoatEta)).reflectance;
      all.add(i, {wi.x, wi.y, max(wi.z, F8(0.0f))}, weight);
    });
    out.white.push_back(std::min(sum_of(white), 1.0f));
    out.coat.push_back(std::min(sum_of(coat), kMost));
  }
  for (const double g : all.balance(std::vector<double>(static_cast<std::size_t>(kAngles * kAzimuths), 1.0))) {
    out.balance.push_back(static_cast<float>(g));
  }
  return out;
}

std::string schlick_tables() {
  std::vector<float> normal, grazing, mean_normal, mean_grazing;
  for (int r = 0; r < kRoughnesses; ++r) {
    const float root_alpha = node(r, kRoughnesses);
    for (int i = 0; i < kAngles; ++i) {
      const float root_cos = node(i, kAngles);
      const Terms e = schlick_terms(root_cos * root_cos, root_alpha * root_alpha);
      grazing.push_back(std::min(e.grazing, 1.0f));
      normal.push_back(std::min(e.normal, 1 - grazing.back()));
    }
    mean_normal.push_back(mean_of(&normal[normal.size() - kAngles]));
    mean_grazing.push_back(mean_of(&grazing[grazing.size() - kAngles]));
  }
  return array("kNormal", normal) + array("kGrazing", grazing) + array("kMeanNormal", mean_normal) +
         array("kMeanGrazing", mean_grazing);
}

std::string gloss_tables() {
  std::vector<float> table, means;
  for (int index = 0; index < kGlossIndices; ++index) {
    for (int r = 0; r < kRoughnesses; ++r) {
      const float root_alpha = node(r, kRoughnesses);
      for (int i = 0; i < kAngles; ++i) {
        const float root_cos = node(i, kAngles);
        table.push_back(std::min(gloss(root_cos * root_cos, root_alpha * root_alpha, gloss_eta(index)), kMost));
      }
      means.push_back(mean_of(&table[table.size() - kAngles]));
    }
  }
  return array("kGloss", table) + array("kMeanGloss", means);
}

std::string metal_table() {
  const std::vector<float> cosines = node_cosines();
  std::vector<float> table(kAngles, 1.0f);
  for (int r = 1; r < kRoughnesses; ++r) {
    const float root_alpha = node(r, kRoughnesses);
    for (const double g : metal(cosines, root_alpha * root_alpha).balance(kAll)) {
      table.push_back(static_cast<float>(g));
    }
  }
  return array("kMetal", table);
}

std::string anisotropic_tables() {
  const std::vector<float> cosines = node_cosines();
  std::vector<float> white, coat, balance, mean_white, mean_coat;
  const auto append = [](std::vector<float>& to, const std::vector<float>& values) {
    to.insert(to.end(), values.begin(), values.end());
  };
  for (int r = 0; r < kRoughnesses; ++r) {
    for (int a = 0; a < kAnisotropies; ++a) {
      const Anisotropic of = anisotropic(cosines, node(r, kRoughnesses), node(a, kAnisotropies));
      append(white, of.white);
      append(coat, of.coat);
      append(balance, of.balance);
      mean_white.push_back(mean_of_azimuths(of.white));
      mean_coat.push_back(mean_of_azimuths(of.coat));
    }
  }
  return array("kAnisotropicWhite", white) + array("kAnisotropicCoat", coat) + array("kAnisotropicMetal", balance) +
         array("kAnisotropicMeanWhite", mean_white) + array("kAnisotropicMeanCoat", mean_coat);
}

std::string coat_table() {
  const std::vector<float> cosines = node_cosines();
  std::vector<float> table(static_cast<std::size_t>(kCoats * kBases * kAngles));
  for (int base = 0; base < kBases; ++base) {
    const float root_base = node(base, kBases);
    const Scattering below = metal(cosines, std::max(root_base * root_base, kSmoothAlpha));
    const std::vector<double> g = below.balance(kAll);
    for (int coat = 0; coat < kCoats; ++coat) {
      const float root_alpha = node(coat, kCoats);
      std::vector<double> left;
      for (const float cosine : cosines) {
        left.push_back(1 - std::min(gloss(cosine, root_alpha * root_alpha, kCoatEta), kMost));
      }
      const std::vector<double> both = below.balance(left);
      for (std::size_t i = 0; i < left.size(); ++i) {
        const double factor = left[i] * g[i] / both[i];
        table[static_cast<std::size_t>((coat * kBases + base) * kAngles) + i] = static_cast<float>(1 - factor * factor);
      }
    }
  }
  return array("kCoat", table);
}

std::string glass_table() {
  const std::vector<float> cosines = node_cosines();
  constexpr int kSlice = kRoughnesses * kAngles, kMiddle = kIndices / 2;
  std::vector<float> table(static_cast<std::size_t>(kIndices * kSlice), 1.0f);
  for (int index = 0; index <= kMiddle; ++index) {
    const float x = node(index, kMiddle + 1);
    // The last one stands for a mirror.
    const float contrast = std::min(kIndexScale * x / (1 + kIndexScale - x), 0.999f);
    // Near eta = 1 almost no light is reflected. Balanced factors would be far from 1, so the compensation fades there.
    const double root_part = std::min(contrast / kFullContrast, 1.0f), part = root_part * root_part;
    for (int r = 1; r < kRoughnesses; ++r) {
      const float root_alpha = node(r, kRoughnesses);
      const std::vector<double> g =
          balanced_glass(cosines, root_alpha * root_alpha, (1 + contrast) / (1 - contrast), part);
      for (int i = 0; i < kAngles; ++i) {
        const auto put = [&](int slice, int at) {
          table[static_cast<std::size_t>(slice * kSlice + r * kAngles + i)] =
              static_cast<float>(g[static_cast<std::size_t>(at)]);
        };
        put(kMiddle - index, kAngles + i);
        put(kMiddle + index, i);
      }
    }
  }
  return array("kGlass", table);
}

}  // namespace
}  // namespace lightmill::ggx

int main() {
  using namespace lightmill::ggx;
  fmt::print("{}{}{}{}{}{}", schlick_tables(), gloss_tables(), metal_table(), coat_table(), glass_table(),
             anisotropic_tables());
  return 0;
}
