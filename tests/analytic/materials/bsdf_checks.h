// Checks that every BSDF must pass: sample, pdf and eval agree, no energy is added, and reciprocity holds. The checks
// use only the BSDF interface (common/materials/bsdf.h).
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <string>

#include "common/materials/bsdf.h"
#include "tests/support/chi_squared.h"
#include "tests/support/lanes.h"

namespace lightmill::test {

inline constexpr int kDraws = 50'000;

inline V8 to_lanes(const Vec3d& v) {
  return broadcast(Vec3(v));
}
/// A direction at an angle to the normal, in the xz plane.
inline Vec3d tilted(double degrees) {
  const double theta = degrees * M_PI / 180;
  return {std::sin(theta), 0, std::cos(theta)};
}

/// A grid of directions on each side of the surface. It is finest around one direction on each side.
///
/// Stereographic projection maps a hemisphere to the unit disk. A Moebius transformation moves the fine point to the
/// centre. Rings around it are spaced evenly in ln(1 + r/w). So the horizon is the edge of the outermost ring.
class Grid {
 public:
  static constexpr int kRings = 24, kSectors = 16, kSideCells = kRings * kSectors, kCells = 2 * kSideCells;
  static constexpr int kSub = 16;  ///< quadrature points along each side of a cell

  /// `widths` (radians): distance from the fine points that the finest structure reaches.
  Grid(const Vec3d& fine_above, const Vec3d& fine_below, double width_above, double width_below)
      : above_(fine_above, width_above), below_(fine_below, width_below) {}
  Grid(const Vec3d& fine_above, const Vec3d& fine_below, double width) : Grid(fine_above, fine_below, width, width) {}

  int cell(const Vec3d& w) const {
    const Side& side = w.z < 0 ? below_ : above_;
    const Complex p = Complex(w.x, w.y) / (1 + std::abs(w.z));
    const Complex q = (p - side.center) / (1.0 - std::conj(side.center) * p);
    const double s = std::log1p(std::abs(q) / side.width) / side.log_end();
    const double phi = std::arg(q) / (2 * M_PI);
    const int ring = std::clamp(static_cast<int>(s * kRings), 0, kRings - 1);
    const int sector = std::clamp(static_cast<int>((phi < 0 ? phi + 1 : phi) * kSectors), 0, kSectors - 1);
    return (w.z < 0 ? kSideCells : 0) + ring * kSectors + sector;
  }

  /// Calls `add(cell, directions, solid angle of each)` on eight directions at a time. Covers the sphere.
  template <class Add>
  void for_each_point(Add add) const {
    for (const bool below : {false, true}) {
      const Side& side = below ? below_ : above_;
      for (int ring = 0; ring < kRings * kSub; ++ring) {
        for (int sector = 0; sector < kSectors * kSub; sector += 8) {
          alignas(32) float x[8], y[8], z[8], omega[8];
          for (int lane = 0; lane < 8; ++lane) {
            const double s = (ring + 0.5) / (kRings * kSub), phi = 2 * M_PI * (sector + lane + 0.5) / (kSectors * kSub);
            const auto [w, area] = side.point(s, phi);
            x[lane] = static_cast<float>(w.x);
            y[lane] = static_cast<float>(w.y);
            z[lane] = static_cast<float>(below ? -w.z : w.z);
            omega[lane] = static_cast<float>(area * 2 * M_PI / (kRings * kSub * kSectors * kSub));
          }
          add((below ? kSideCells : 0) + ring / kSub * kSectors + sector / kSub,
              V8{F8::load(x), F8::load(y), F8::load(z)}, F8::load(omega));
        }
      }
    }
  }

 private:
  using Complex = std::complex<double>;
  struct Side {
    Complex center;
    double width;
    Side(const Vec3d& fine, double angle) : center(Complex(fine.x, fine.y) / (1 + std::abs(fine.z))) {
      const double most = std::max(0.0, 1 - std::max(angle, 1e-3));
      center *= std::min(1.0, most / std::max(std::abs(center), 1e-9));
      width = angle * (1 + std::norm(center)) / (2 * (1 - std::norm(center)));
    }
    double log_end() const { return std::log1p(1 / width); }
    /// The direction at (s, phi), with z > 0, and solid angle per ds dphi.
    std::pair<Vec3d, double> point(double s, double phi) const {
      const double r = width * std::expm1(s * log_end());
      const Complex q = std::polar(r, phi);
      const Complex p = (q + center) / (1.0 + std::conj(center) * q);
      const double stretch = (1 - std::norm(center)) / std::norm(1.0 + std::conj(center) * q);
      const double n = 1 + std::norm(p);
      const double dr = (width + r) * log_end();
      return {Vec3d(2 * p.real() / n, 2 * p.imag() / n, (1 - std::norm(p)) / n),
              4 / (n * n) * stretch * stretch * r * dr};
    }
  };

  Side above_, below_;
};

inline Vec3d mirrored(const Vec3d& w) {
  return {-w.x, -w.y, w.z};
}
/// Direction of refraction at a smooth surface. Straight down at total reflection.
inline Vec3d refracted(const Vec3d& wo, double eta) {
  const double sin2 = (1 - wo.z * wo.z) / (eta * eta);
  return sin2 < 1 ? Vec3d(-wo.x / eta, -wo.y / eta, -std::sqrt(1 - sin2)) : Vec3d(0, 0, -1);
}

/// Calls `use(sample, lane)` for each of kDraws independent draws.
template <class Bsdf, class Use>
void for_each_sample(const Bsdf& bsdf, const V8& wo, std::uint32_t seed, Use use) {
  for (int i = 0; i < kDraws; i += 8) {
    const U8 index = U8(static_cast<std::uint32_t>(i)) + U8::lane_index();
    use(bsdf.sample(wo, hashed_pair(index, U8(mix(seed))), hashed_number(index, U8(mix(seed + 1)))));
  }
}

/// Compares draws with the pdf, and weights with eval/pdf. Draws of weight 0 (lost below the surface) have a cell of
/// their own. Returns the statistic of chi_squared_z. `tolerance` is the relative one of weight · pdf = eval.
template <class Bsdf>
double sample_z(const Bsdf& bsdf, const Vec3d& from, const Grid& grid, std::uint32_t seed, double tolerance) {
  const V8 wo = to_lanes(from);
  std::vector<double> counts(Grid::kCells + 1), expected(Grid::kCells + 1);
  int wrong_weights = 0, wrong_sides = 0;
  for_each_sample(bsdf, wo, seed, [&](const BsdfSample8& s) {
    const Lanes x(s.wi.x), y(s.wi.y), z(s.wi.z), weight(s.weight.y), pdf(s.pdf_solid_angle);
    const Lanes eval(bsdf.eval(wo, s.wi).y), pdf_again(bsdf.pdf_solid_angle(wo, s.wi));
    for (int i = 0; i < 8; ++i) {
      if (weight[i] == 0 || pdf[i] == 0) {
        counts[Grid::kCells] += 1;
        continue;
      }
      counts[grid.cell({x[i], y[i], z[i]})] += 1;
      wrong_weights += std::abs(weight[i] * pdf[i] - eval[i]) > tolerance * eval[i] + 1e-6 ||
                       std::abs(pdf[i] - pdf_again[i]) > tolerance * pdf[i];
      wrong_sides += ((s.transmitted.bits() >> i & 1) != 0) != (z[i] < 0);
    }
  });
  EXPECT_LE(wrong_weights, kDraws / 10'000);  // rounding in a far tail or at a grazing angle
  EXPECT_EQ(wrong_sides, 0);
  expected[Grid::kCells] = kDraws;
  grid.for_each_point([&](int cell, const V8& wi, F8 omega) {
    const Lanes p(bsdf.pdf_solid_angle(wo, wi) * omega);
    for (int i = 0; i < 8; ++i) {
      expected[cell] += kDraws * p[i];
      expected[Grid::kCells] -= kDraws * p[i];
    }
  });
  // Quadrature cannot distinguish this from zero.
  if (std::abs(expected[Grid::kCells]) < 5e-3 * kDraws && counts[Grid::kCells] < 5e-3 * kDraws) {
    expected[Grid::kCells] = counts[Grid::kCells];
  }
  return chi_squared_z(counts, expected);
}

/// Outgoing energy under radiance 1 from everywhere. Transmitted radiance is η² denser where it comes from.
struct Albedo {
  double by_quadrature = 0, by_sampling = 0, standard_error = 0;
};
template <class Bsdf>
Albedo directional_albedo(const Bsdf& bsdf, const Vec3d& from, const Grid& grid, std::uint32_t seed, double eta = 1) {
  const V8 wo = to_lanes(from);
  Albedo albedo;
  grid.for_each_point([&](int, const V8& wi, F8 omega) {
    const Lanes f(bsdf.eval(wo, wi).y * omega), z(wi.z);
    for (int i = 0; i < 8; ++i) {
      albedo.by_quadrature += f[i] * (z[i] < 0 ? eta * eta : 1);
    }
  });
  double sum = 0, squares = 0;
  for_each_sample(bsdf, wo, seed, [&](const BsdfSample8& s) {
    const Lanes weight(s.weight.y), z(s.wi.z);
    for (int i = 0; i < 8; ++i) {
      const double energy = weight[i] * (z[i] < 0 ? eta * eta : 1);
      sum += energy;
      squares += energy * energy;
    }
  });
  albedo.by_sampling = sum / kDraws;
  albedo.standard_error = std::sqrt(std::max(0.0, squares / kDraws - albedo.by_sampling * albedo.by_sampling) / kDraws);
  return albedo;
}

/// The albedo from 16,384 draws that fill the unit cube evenly: a lattice of the plastic number and its powers (Roberts
/// 2018). For surfaces whose samples have almost equal weights.
template <class Bsdf>
double even_albedo(const Bsdf& bsdf, const Vec3d& from, double eta = 1) {
  constexpr int kPoints = 16'384;
  double sum = 0;
  for (int i = 0; i < kPoints; i += 8) {
    alignas(32) float u[8], v[8], choice[8];
    for (int lane = 0; lane < 8; ++lane) {
      const auto at = [&](double step) {
        double whole;
        return static_cast<float>(std::modf(0.5 + (i + lane) * step, &whole));
      };
      u[lane] = at(0.8191725133961645);
      v[lane] = at(0.6710436067037893);
      choice[lane] = std::min(at(0.5497004779019703), 0x1.fffffep-1f);
    }
    const BsdfSample8 s =
        bsdf.sample(to_lanes(from), {F8::load(u), min(F8::load(v), F8(0x1.fffffep-1f))}, F8::load(choice));
    const Lanes weight(s.weight.y), z(s.wi.z);
    for (int lane = 0; lane < 8; ++lane) {
      sum += weight[lane] * (z[lane] < 0 ? eta * eta : 1);
    }
  }
  return sum / kPoints;
}

/// f(wo, wi) = f(wi, wo) on either side, and η² f(wo, wi) = f(wi, wo) through the surface. `make(front)` gives the BSDF of
/// either side. `directions` are as seen from the front.
template <class Make>
void expect_reciprocity(Make make, double eta, bool transmits, double tolerance) {
  const auto front = [&](const Vec3d& wo) { return make(to_lanes(wo), M8(true)); };
  const auto back = [&](const Vec3d& wo) { return make(to_lanes(wo), M8(false)); };
  for (int i = 0; i < 2000; ++i) {
    const auto direction = [&](std::uint32_t seed) {
      const Lanes u(hashed_pair(U8(static_cast<std::uint32_t>(i)), U8(mix(seed))).u);
      const Lanes v(hashed_pair(U8(static_cast<std::uint32_t>(i)), U8(mix(seed))).v);
      const double z = 0.02 + 0.98 * u[0], r = std::sqrt(1 - z * z), phi = 2 * M_PI * v[0];
      return Vec3d(r * std::cos(phi), r * std::sin(phi), z);
    };
    const Vec3d a = direction(7), b = direction(8);
    const double ab = Lanes(front(a).eval(to_lanes(a), to_lanes(b)).x)[0] / b.z;
    const double ba = Lanes(front(b).eval(to_lanes(b), to_lanes(a)).x)[0] / a.z;
    ASSERT_NEAR(ab, ba, tolerance * std::max(ab, ba) + 1e-6) << i;
    if (transmits) {
      const double behind_ab = Lanes(back(a).eval(to_lanes(a), to_lanes(b)).x)[0] / b.z;
      const double behind_ba = Lanes(back(b).eval(to_lanes(b), to_lanes(a)).x)[0] / a.z;
      ASSERT_NEAR(behind_ab, behind_ba, tolerance * std::max(behind_ab, behind_ba) + 1e-6) << i;
      // b is behind the surface, where z points the other way.
      const double through = Lanes(front(a).eval(to_lanes(a), to_lanes({b.x, b.y, -b.z})).x)[0] / b.z;
      const double reverse = Lanes(back(b).eval(to_lanes(b), to_lanes({a.x, a.y, -a.z})).x)[0] / a.z;
      ASSERT_NEAR(through * eta * eta, reverse, tolerance * std::max(through * eta * eta, reverse) + 1e-6) << i;
    }
  }
}

}  // namespace lightmill::test
