// Weights of vertex connection and merging, by the balance heuristic: a technique's density over the sum of all five.
//
// Georgiev 2012, "Implementing Vertex Connection and Merging" (technical report), has this recursive form. Densities of
// directions are per solid angle, those of points per area. No density includes Russian roulette. With one merging
// factor per vertex, η = π r² · light paths, the report's third partial sum dVM is dVC/η. So a subpath keeps two.
#pragma once

#include "common/math/simd.h"

namespace lightmill::vcm {

/// Partial sums dVCM and dVC of a subpath that has arrived at a vertex. Before the next vertex is known, they lack the
/// factors of distance and cosine.
struct Partial8 {
  F8 vcm, vc;
};
inline Partial8 select(M8 mask, const Partial8& yes, const Partial8& no) {
  return {lightmill::select(mask, yes.vcm, no.vcm), lightmill::select(mask, yes.vc, no.vc)};
}

/// Densities of a light, as seen from a point that it lights.
struct LightDensities8 {
  F8 emission;  ///< of photons that start there in that direction: per area and solid angle. Area is of a surface, or
                ///< across the light of a distant one. It is 1 for points. Solid angle is 1 for parallel light
  F8 drawn;     ///< of next-event estimation from the point, per solid angle. For parallel light it is the
                ///< probability of choosing it. For points it is that probability times the squared distance
  F8 cosine;    ///< at the light's surface; else 1
  M8 delta;     ///< no ray can hit it
};

/// A light path arrives at its first surface. `cosine`: at this surface.
inline Partial8 first_arrival(const LightDensities8& light, F8 cosine) {
  const F8 per_emission = F8(1.0f) / (light.emission * cosine);
  return {light.drawn * light.cosine * per_emission, masked(~light.delta, light.cosine * per_emission)};
}

/// A camera path starts. `pdf_solid_angle`: of its first direction, for one path per pixel.
inline Partial8 camera_start(F8 pdf_solid_angle, float light_paths) {
  return {F8(light_paths) / pdf_solid_angle, F8(0.0f)};
}

/// A subpath arrives at a surface. `distance2`: squared length of the segment. `cosine`: at the surface.
inline Partial8 arrive(const Partial8& p, F8 distance2, F8 cosine) {
  const F8 per_cosine = F8(1.0f) / cosine;
  return {p.vcm * distance2 * per_cosine, p.vc * per_cosine};
}

/// Sum over the techniques behind a vertex. `pdf_back`: density of the reverse direction, as seen from the next vertex.
inline F8 behind(const Partial8& arrived, F8 merging, F8 pdf_back) {
  return merging + arrived.vcm + arrived.vc * pdf_back;
}

/// A subpath is scattered. `cosine`, `pdf`: of the new direction. `pdf_back`: density of the reverse direction.
inline Partial8 scatter(const Partial8& arrived, F8 merging, F8 cosine, F8 pdf, F8 pdf_back) {
  const F8 per_pdf = F8(1.0f) / pdf;
  return {per_pdf, cosine * per_pdf * behind(arrived, merging, pdf_back)};
}
/// The same by a delta BSDF.
inline Partial8 scatter_delta(const Partial8& arrived, F8 cosine) {
  return {F8(0.0f), cosine * arrived.vc};
}

inline F8 weight_of(F8 others) {
  return F8(1.0f) / (F8(1.0f) + others);
}

/// A camera path has hit a light that next-event estimation samples.
inline F8 found_light(const Partial8& on_way, const LightDensities8& light) {
  return weight_of(light.drawn * on_way.vcm + light.emission * on_way.vc / light.cosine);
}

/// A sampled point of a light is connected to a camera path's vertex. `cosine`: at the vertex. `pdf`: of the BSDF in
/// this direction.
inline F8 sampled_light(const Partial8& arrived, F8 merging, F8 cosine, F8 pdf, F8 pdf_back,
                        const LightDensities8& light) {
  const F8 by_chance = masked(~light.delta, pdf / light.drawn);
  const F8 by_light = light.emission * cosine / (light.drawn * light.cosine);
  return weight_of(by_chance + by_light * behind(arrived, merging, pdf_back));
}

/// Two vertices are connected. `camera`, `light`: `behind` of each. Densities are of sampling the direction to the
/// other vertex. Cosines are to the surfaces.
inline F8 connected(F8 camera, F8 camera_pdf, F8 camera_cosine, F8 light, F8 light_pdf, F8 light_cosine, F8 distance2) {
  const F8 per_distance2 = F8(1.0f) / distance2;
  return weight_of(camera_pdf * light_cosine * per_distance2 * light +
                   light_pdf * camera_cosine * per_distance2 * camera);
}

/// A light vertex is connected to the camera. `camera_pdf_area`: of camera rays at the vertex, for one per pixel.
/// `light`: its `behind`.
inline F8 splatted(F8 light, F8 camera_pdf_area, float light_paths) {
  return weight_of(camera_pdf_area * F8(1.0f / light_paths) * light);
}

/// Two paths have arrived at one vertex. `pdf`: of the camera path's BSDF in the light path's direction. `pdf_back`: of
/// the light path's BSDF in the camera path's direction.
inline F8 merged(const Partial8& camera, const Partial8& light, F8 merging, F8 pdf, F8 pdf_back) {
  return weight_of((light.vcm + light.vc * pdf + camera.vcm + camera.vc * pdf_back) / merging);
}

}  // namespace lightmill::vcm
