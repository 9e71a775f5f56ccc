// Connecting vertices of camera paths to lamps and to vertices of light paths: the templates of Batch, for
// scattering.h.
#pragma once

#include "common/methods/path/batch.h"
#include "common/methods/vcm/light_densities.h"
#include "common/methods/vcm/pdf_back.h"

namespace lightmill::path {

/// Where a BSDF can scatter: both normals must agree on which side it is.
template <class Bsdf>
M8 scatters_to(const V8& wi, F8 side) {
  const M8 above = (wi.z > F8(0.0f)) & (side > F8(0.0f));
  if constexpr (Bsdf::kTransmits) {
    return above | ((wi.z < F8(0.0f)) & (side < F8(0.0f)));
  } else {
    return above;
  }
}

template <class Bsdf>
F8 Batch::sampled_light_weight(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, const V8& wi,
                               const LightSample8& light, M8 lanes) const {
  const PhotonEmission& emission = *light_pass_->emission;
  const V8& from = vertex.surface.point;
  const V8 travel = -light.wi;
  const F8 cosine = emission.cosine(light.light, light.point, travel, lanes);
  const vcm::LightDensities8 densities =
      vcm::light_densities(scene_, emission, light.light, from, light.point, travel, cosine, lanes);
  const F8 back = vcm::pdf_back(scene_, vertex.surface, vertex.crossing, bsdf, wo, wi, lanes);
  return vcm::sampled_light(vertex.partial, vertex.merging, abs(dot(light.wi, vertex.facing)),
                            bsdf.pdf_solid_angle(wo, wi), back, densities);
}

/// To all vertices of one light path of the pass, which each vertex draws anew.
template <class Bsdf>
void Batch::connect(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
  if constexpr (!requires { Bsdf::kEndsPaths; }) {  // holdouts compare the light of lamps alone
    const photons::LightPass& pass = *light_pass_;
    if (pass.deposits.empty()) {
      return;
    }
    const Path8& in = vertex.in;
    const F8 drawn = hashed_number(in.index, decision_seed(in.pixel_seed, connection_decision(vertex.bounce)));
    const U8 light_path = truncate(drawn * F8(static_cast<float>(pass.photons)));
    U8 at = gather(pass.path_first.data(), light_path, lanes);
    const U8 end = gather(pass.path_first.data(), light_path + U8(1u), lanes);
    for (M8 active = lanes & signed_less(at, end); active.any(); active = active & signed_less(at, end)) {
      const U8 number = gather(pass.path_deposits.data(), at, active);
      at = at + U8(1u);
      const photons::Deposit8 d = photons::load_deposits(pass.deposits, number, active);
      const V8 way = d.point - vertex.surface.point;
      const V8 direction = way * (F8(1.0f) / sqrt(length_squared(way)));
      const V8 wi = vertex.frame.to_local(direction);
      const F8 side = dot(direction, vertex.facing);
      const V8 value = in.throughput * bsdf.eval(wo, wi);
      const M8 valid = active & scatters_to<Bsdf>(wi, side) & (max_component(value) > F8(0.0f)) &
                       signed_less(d.scatterings, U8(max_bounces_ - vertex.bounce));
      if (valid.none()) {
        continue;
      }
      const F8 back = vcm::pdf_back(scene_, vertex.surface, vertex.crossing, bsdf, wo, wi, valid);
      const V8 origin = vertex.surface.point + vertex.facing * copysign(vertex.surface.offset, side);
      const Media8 media = select(side < F8(0.0f), vertex.crossing.beyond, in.media);
      ws_.connections.push(valid, {origin, value, in.slot, number, bsdf.pdf_solid_angle(wo, wi),
                                   vcm::behind(vertex.partial, vertex.merging, back), abs(side), media});
      if (ws_.connections.full()) {
        trace_connections();
      }
    }
  }
}

}  // namespace lightmill::path
