// Reflection models as published, in double precision and without code of the renderer: BSDF times the cosine of wi.
// Directions point away from a surface with normal +y.
#pragma once

#include <cmath>
#include <complex>

#include "common/math/vec.h"

namespace lightmill::test {

/// A direction about +z, about +y.
inline Vec3d upright(const Vec3d& w) {
  return {w.x, w.z, w.y};
}

inline double phong_formula(double d, double s, double exponent, const Vec3d& wo, const Vec3d& wi) {
  const double cosine = std::max(0.0, glm::dot(Vec3d(-wo.x, wo.y, -wo.z), wi));
  return (d / M_PI + s * (exponent + 2) / (2 * M_PI) * std::pow(cosine, exponent)) * wi.y;
}
/// The factor A of Fujii's formula.
inline double fujii_scale(double roughness) {
  return 1 / (1 + (0.5 - 2 / (3 * M_PI)) * roughness);
}
/// Oren and Nayar's model in Fujii's form.
inline double fujii_formula(double albedo, double roughness, const Vec3d& wo, const Vec3d& wi) {
  const double s = glm::dot(wo, wi) - wo.y * wi.y, t = s > 0 ? std::max(wo.y, wi.y) : 1;
  return albedo / M_PI * fujii_scale(roughness) * (1 + roughness * s / t) * wi.y;
}
/// Its directional albedo for reflectance 1, from the exact integral.
inline double fujii_albedo(double roughness, double cosine) {
  const double theta = std::acos(cosine), sine = std::sin(theta);
  const double g = sine * (theta - sine * cosine - 2.0 / 3) + 2.0 / 3 * sine / cosine * (1 - sine * sine * sine);
  return fujii_scale(roughness) * (1 + roughness * g / M_PI);
}
/// EON: Fujii's model with multiple scattering (Portsmouth, Kutz and Hill 2025).
inline double eon_formula(double albedo, double roughness, const Vec3d& wo, const Vec3d& wi) {
  const double mean = fujii_scale(roughness) * (1 + (2.0 / 3 - 28 / (15 * M_PI)) * roughness);
  const double again = albedo * albedo * mean / (1 - albedo * (1 - mean));
  return fujii_formula(albedo, roughness, wo, wi) +
         again / M_PI * (1 - fujii_albedo(roughness, wo.y)) * (1 - fujii_albedo(roughness, wi.y)) / (1 - mean) * wi.y;
}
inline double ggx_d(double cos_m, double alpha) {
  const double tan2 = 1 / (cos_m * cos_m) - 1;
  return alpha * alpha / (M_PI * std::pow(cos_m, 4) * std::pow(alpha * alpha + tan2, 2));
}
inline double ggx_lambda(double cosine, double alpha) {
  return (std::sqrt(1 + alpha * alpha * (1 / (cosine * cosine) - 1)) - 1) / 2;
}
inline double fresnel_formula(double cosine, std::complex<double> index) {
  const std::complex<double> ct = std::sqrt(1.0 - (1 - cosine * cosine) / (index * index));
  return (std::norm((cosine - index * ct) / (cosine + index * ct)) +
          std::norm((index * cosine - ct) / (index * cosine + ct))) /
         2;
}
inline double conductor_formula(double n, double k, double alpha, const Vec3d& wo, const Vec3d& wi) {
  const Vec3d m = glm::normalize(wo + wi);
  const double g = 1 / (1 + ggx_lambda(wo.y, alpha) + ggx_lambda(wi.y, alpha));
  return ggx_d(m.y, alpha) * g * fresnel_formula(glm::dot(wo, m), {n, k}) / (4 * wo.y);
}
/// Walter et al. 2007, eq. 21, for light from the denser side below.
inline double refraction_formula(double n, double alpha, const Vec3d& wo, const Vec3d& wi) {
  Vec3d m = -glm::normalize(wo + wi * n);
  m = m.y < 0 ? -m : m;
  const double g = 1 / (1 + ggx_lambda(wo.y, alpha)) / (1 + ggx_lambda(wi.y, alpha));
  const double om = glm::dot(wo, m), im = glm::dot(wi, m);
  const double transmittance = 1 - fresnel_formula(om, n);
  return std::abs(im * om) / wo.y * transmittance * g * ggx_d(m.y, alpha) / std::pow(om + n * im, 2);
}

/// ∫ f(wi) dωi over the directions above the surface, or below it.
template <class Formula>
double integral_over_hemisphere(Formula f, bool below = false, int steps = 400) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double theta = (i + 0.5) / steps * M_PI / 2, z = std::cos(theta), r = std::sin(theta);
    for (int j = 0; j < steps; ++j) {
      const double phi = 2 * M_PI * (j + 0.5) / steps;
      sum += f(Vec3d(r * std::cos(phi), below ? -z : z, r * std::sin(phi))) * r;
    }
  }
  return sum * M_PI / 2 / steps * 2 * M_PI / steps;
}

/// Radiance of a floor's point below a sphere light of radiance 1. The formula is summed over the light's cone, in this
/// many rings and sectors.
template <class Formula>
double lit_by_sphere(const Vec3d& center, double radius, const Vec3d& wo, Formula f, int steps = 600) {
  const double distance = glm::length(center), sin_max = radius / distance;
  const double one_minus_cos = 1 - std::sqrt(1 - sin_max * sin_max);
  const Vec3d n = center / distance, s = glm::normalize(glm::cross(n, Vec3d(0.1, 0.2, 0.9))), t = glm::cross(n, s);
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double h = (i + 0.5) / steps * one_minus_cos, phi = 2 * M_PI * (j + 0.5) / steps;
      const double r = std::sqrt(h * (2 - h));
      sum += f(wo, n * (1 - h) + (s * std::cos(phi) + t * std::sin(phi)) * r);
    }
  }
  return sum * 2 * M_PI * one_minus_cos / (steps * steps);
}

/// Estevez and Kulla 2017, with alpha = roughness².
inline double sheen_formula(double roughness, const Vec3d& wo, const Vec3d& wi) {
  const double alpha = roughness * roughness, t = (1 - alpha) * (1 - alpha);
  const auto mix = [&](double rough, double smooth) { return rough * (1 - t) + smooth * t; };
  const double a = mix(21.5473, 25.3245), b = mix(3.82987, 3.32435), c = mix(0.19823, 0.16801),
               d = mix(-1.97760, -1.27393), e = mix(-4.32054, -4.85967);
  const auto fit = [&](double x) { return a / (1 + b * std::pow(x, c)) + d * x + e; };
  const auto lambda = [&](double x) { return x < 0.5 ? std::exp(fit(x)) : std::exp(2 * fit(0.5) - fit(1 - x)); };
  const double cosine = glm::normalize(wo + wi).y;
  const double density = (2 + 1 / alpha) * std::pow(1 - cosine * cosine, 0.5 / alpha) / (2 * M_PI);
  return density / ((1 + lambda(wo.y) + lambda(wi.y)) * 4 * wo.y);
}

}  // namespace lightmill::test
