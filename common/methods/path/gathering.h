// Gathering the deposits of photons at vertices of camera paths: the templates of Batch, for scattering.h.
#pragma once

#include <algorithm>
#include <numeric>

#include "common/methods/path/batch.h"
#include "common/methods/vcm/pdf_back.h"

namespace lightmill::path {

/// What a surface sends on of light from a direction, over its power: BSDF · |cosine to the shading normal| / |cosine
/// to the geometric one|. Both normals must agree on which side the light is.
template <class Bsdf>
V8 sent_on(const Bsdf& bsdf, const V8& wo, const Frame8& frame, const V8& facing, const V8& from) {
  const V8 wi = frame.to_local(from);
  const F8 side = dot(from, facing);
  M8 valid = (wi.z > F8(0.0f)) & (side > F8(0.0f));
  if constexpr (Bsdf::kTransmits) {
    valid = valid | ((wi.z < F8(0.0f)) & (side < F8(0.0f)));
  }
  return masked(valid, bsdf.eval(wo, wi) * (F8(1.0f) / abs(side)));
}

template <class Bsdf>
void Batch::gather_deposits(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
  if constexpr (!requires { Bsdf::kEndsPaths; }) {  // holdouts receive no caustics
    const bool splatted = vertex.bounce == 0 && meter_ == nullptr && !photons_bring_all();
    if (connects()) {
      // A meter that is no place of the scene has no deposits.
      const bool nowhere = vertex.bounce == 0 && meter_ != nullptr && !meter_->looks;
      if (!nowhere) {
        gather_from(light_pass_->merge_map, light_pass_->merging.at(vertex.surface.point), vertex, bsdf, wo, lanes);
      }
      return;
    }
    lanes = and_not(lanes, vertex.casters) & (vertex.in.chain == U8(kFromEye));
    if (splatted || lanes.none()) {
      return;
    }
    const photons::LightPass& pass = *light_pass_;
    const F8 way = vertex.in.way + way_to(vertex);
    const F8 radius = min(max(way * F8(pass.radius_per_length), F8(pass.least)), F8(pass.most));
    gather_from(pass.first, radius, vertex, bsdf, wo, lanes);
    gather_from(pass.later, radius * F8(photons::LightPass::kLater), vertex, bsdf, wo, lanes);
  }
}

template <class Map, class Bsdf>
void Batch::gather_from(const Map& map, F8 radius, const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
  if (!map.empty()) {
    find_near(map, vertex.surface.point, radius, lanes);
    add_found(radius, vertex, bsdf, wo, lanes);
  }
}

/// Fills `found` by lane.
template <class Map>
void Batch::find_near(const Map& map, const V8& point, F8 radius, M8 lanes) {
  const VectorLanes points(point);
  alignas(32) float radii[8];
  radius.store(radii);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    ws_.found[lane].clear();
    if (lanes.bits() >> lane & 1) {
      map.find(points[static_cast<int>(lane)], radii[lane], ws_.found[lane]);
    }
  }
  ws_.counters.gathers += static_cast<std::uint64_t>(lanes.count());
}

/// The density of deposits on the disc of this radius: Jensen 1996, "Global Illumination using Photon Maps", eq. 3.
/// Those of other surfaces that are near by are told by their normals and by how far they lie off the disc.
template <class Bsdf>
void Batch::add_found(F8 radius, const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
  constexpr float kLeastCosine = 0.8f, kMostHeight = 0.25f;  ///< of normals; in radii
  alignas(32) std::uint32_t counts[8];
  for (std::size_t lane = 0; lane < 8; ++lane) {
    counts[lane] = static_cast<std::uint32_t>(ws_.found[lane].size());
  }
  const std::uint32_t most = *std::ranges::max_element(counts);
  ws_.counters.gathered += std::accumulate(std::begin(counts), std::end(counts), std::uint64_t{0});
  const F8 per_area = F8(kInvPi) / (radius * radius);
  V8 sum, beyond_half;
  for (std::uint32_t k = 0; k < most; ++k) {
    alignas(32) std::uint32_t numbers[8] = {};
    for (std::size_t lane = 0; lane < 8; ++lane) {
      if (k < counts[lane]) {
        numbers[lane] = ws_.found[lane][k];
      }
    }
    M8 valid = signed_less(U8(k), U8::load(counts));
    const photons::Deposit8 d = photons::load_deposits(light_pass_->deposits, U8::load(numbers), valid);
    const V8& normal = vertex.surface.geometric_normal;
    const F8 height = abs(dot(d.point - vertex.surface.point, normal));
    valid = valid & (dot(d.normal, normal) > F8(kLeastCosine)) & (height < radius * F8(kMostHeight)) &
            signed_less(d.scatterings, U8(max_bounces_ - vertex.bounce + 1));
    V8 value = masked(valid, d.power * sent_on(bsdf, wo, vertex.frame, vertex.facing, d.wi) * per_area);
    if (connects()) {
      const V8 wi = vertex.frame.to_local(d.wi);
      const F8 back = vcm::pdf_back(scene_, vertex.surface, vertex.crossing, bsdf, wo, wi, valid);
      value = value * vcm::merged(vertex.partial, light_pass_->partials(U8::load(numbers), valid), vertex.merging,
                                  bsdf.pdf_solid_angle(wo, wi), back);
    }
    if (channels_.bias >= 0) {  // four times as dense on a disc of half the radius
      const F8 half = radius * F8(0.5f);
      const M8 within =
          (length_squared(d.point - vertex.surface.point) < half * half) & (height < half * F8(kMostHeight));
      beyond_half = beyond_half + masked(valid, select(within, value * F8(-3.0f), value));
    }
    if (connects()) {
      const M8 lit = valid & (max_component(value) > F8(0.0f));
      add_brought(lit, vertex.in.slot, d, vertex.in.throughput * value, vertex.bounce);
      continue;
    }
    if (channels_.separates_lights()) {
      add_caustic(valid, vertex.in.slot, d.group, vertex.in.throughput * value);
    } else {
      sum = sum + value;
    }
  }
  if (most > 0 && !connects() && !channels_.separates_lights()) {
    add_caustic(lanes, vertex.in.slot, U8(0u), vertex.in.throughput * sum);
  }
  if (most > 0 && channels_.bias >= 0) {
    add_to_plane(channels_.bias, lanes, vertex.in.slot, vertex.in.throughput * beyond_half);
  }
}

}  // namespace lightmill::path
