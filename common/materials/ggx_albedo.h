// Albedos of GGX surfaces, and factors that compensate for multiple scattering. Tabulated by a step of the build
// (ggx_tabulate.cpp).
//
// ggx.h models single scattering. It loses light that meets several facets, up to 69 %. `balance` has factors g ≥ 0
// with g(wo) ∫ f(wo, wi) g(wi) |cos θi| dωi = 1 for a white f, by scaling a symmetric kernel (Sinkhorn and Knopp 1967).
// So g(wo) f g(wi) keeps all light. It is reciprocal where f is, and its samples have the density of f.
#pragma once

#include "common/math/vec.h"

namespace lightmill::ggx {

/// Albedos of reflection by metal (single scattering) with Schlick's Fresnel term F = f0 (1 − w) + f90 w,
/// w = (1 − cos)⁵. They are linear in f0 and f90.
struct Albedo8 {
  F8 normal;                                                          ///< albedo per f0
  F8 grazing;                                                         ///< albedo per f90
  F8 of(F8 f0, F8 f90) const { return f0 * normal + f90 * grazing; }  ///< at most 1 for f0, f90 <= 1
};
Albedo8 albedo(F8 cos_theta, F8 alpha);
/// Mean of `albedo` over the hemisphere, weighted by cos θ.
Albedo8 mean_albedo(F8 alpha);

/// Albedo of reflection by facets of a dielectric with the index `eta` >= 1 (single scattering, Fresnel's equations). That
/// of rough ones is interpolated. More than 10° above the horizon, the error is at most 0.001 for eta up to 1.8, 0.0045 up
/// to 10, 0.012 up to 40, and 0.09 for others. Values are slightly below 1 at most, because 1 − albedo is a divisor.
F8 gloss_albedo(F8 cos_theta, F8 alpha, F8 eta);
/// Its mean over the hemisphere, weighted by cos θ.
F8 mean_gloss_albedo(F8 alpha, F8 eta);
/// The same for kCoatEta.
F8 coat_albedo(F8 cos_theta, F8 alpha);
F8 mean_coat_albedo(F8 alpha);
inline constexpr float kCoatEta = 1.5f;  ///< index of coats

/// g of facets that reflect all light. For alpha 1 it is H/√2 with Chandrasekhar's H function. Metal multiplies single
/// scattering by 1 + κ (g(wo) g(wi) − 1), with κ from `kept_by_bounces`.
F8 balance(F8 cos_theta, F8 alpha);
/// g of clear glass. `eta`: index of refraction behind the surface over that on the direction's side. Between 1/1.2 and
/// 1.2 the compensation is partial. It fades to none at 1.
F8 balance(F8 cos_theta, F8 alpha, F8 eta);

// The same for anisotropic facets, from tables of their own (ggx_facets.h). x is the direction of the anisotropy, and
// `alpha` is that along y. `anisotropy` is the strength, above 0.
// White facets reflect all light.
F8 white_albedo(const V8& w, F8 alpha, F8 anisotropy);
F8 mean_white_albedo(F8 alpha, F8 anisotropy);
F8 coat_albedo(const V8& w, F8 alpha, F8 anisotropy);
F8 mean_coat_albedo(F8 alpha, F8 anisotropy);
F8 balance(const V8& w, F8 alpha, F8 anisotropy);

/// Mean albedo E' of a coat over the directions into which white facets below it scatter. With it,
/// (1 − E(wo)) (1 − E(wi))/√((1 − E'(wo))(1 − E'(wi))) of their light leaves all light that the coat does not reflect.
F8 coat_below(F8 cos_theta, F8 coat_alpha, F8 alpha);

/// Share κ of the lost light that the compensation of metal returns: F L/(1 − F (1 − L)), the sum of the bounces after
/// the first (Kulla and Conty 2017). F is the mean reflectance of a facet, 0 for no compensation. L is the share of
/// light that leaves after each bounce. It is the root of the mean albedo of white facets, a fit to random walks on
/// random surfaces of facets. `mean`: mean_albedo.
V8 kept_by_bounces(const V8& mean_fresnel, const Albedo8& mean);

}  // namespace lightmill::ggx
