// Shading with any BSDF: what of Batch the files need that know BSDFs.
#pragma once

#include "common/methods/path/batch.h"
#include "common/methods/path/connecting.h"
#include "common/methods/path/gathering.h"

namespace lightmill::path {

/// Where lights are sampled though photons bring all that receivers get: on casters, and where holdouts compare light.
template <class Bsdf>
M8 lamps_beside_photons(const Vertex8& vertex) {
  if constexpr (requires { Bsdf::kEndsPaths; }) {
    return M8(true);
  } else {
    return vertex.casters;
  }
}

/// Russian roulette, then the queue.
[[gnu::always_inline]] inline void Batch::go_on(Path8& out, M8 lanes, std::uint32_t bounce) {
  if (bounce >= plan_.first_roulette) {
    const F8 survival = max_component(out.throughput) * out.roulette_scale * F8(plan_.roulette_boost);
    const M8 at_risk = survival < F8(1.0f);
    if ((lanes & at_risk).any()) {
      const F8 u = hashed_number(out.index, decision_seed(out.pixel_seed, choice_decision(bounce)));
      lanes = lanes & ~(at_risk & (u >= survival));
      out.throughput = out.throughput * select(at_risk, F8(1.0f) / survival, F8(1.0f));
    }
  }
  if (lanes.any()) {
    ws_.next.push(lanes, out);
  }
}

/// Sets the ray that `sample` asks for. Samples on whose side of the surface the two normals disagree end.
[[gnu::always_inline]] inline void Batch::leave(const Vertex8& vertex, const BsdfSample8& sample, Path8& out,
                                                M8 lanes) {
  const F8 offset = vertex.surface.offset;
  out.direction = vertex.frame.to_world(sample.wi);
  out.origin = vertex.surface.point + vertex.facing * select(sample.transmitted, -offset, offset);
  out.pdf_solid_angle = sample.pdf_solid_angle;
  out.roulette_scale = out.roulette_scale * (sample.eta * sample.eta);
  if (light_pass_ != nullptr && !connects()) {
    const M8 from_eye = out.chain == U8(kFromEye);
    const M8 delta = sample.pdf_solid_angle == F8(0.0f);
    out.chain = select(vertex.casters, select(from_eye, U8(kFromEye), U8(kOverCasters)),
                       select(from_eye & delta, U8(kFromEye), U8(kFromReceiver)));
    out.way = out.way + way_to(vertex);
  }
  if (photons_bring_all()) {
    lanes = lanes & ((out.chain == U8(kFromEye)) | ~goes_on(out));
  }
  if (scene_.features().media) {
    out.media = select(sample.transmitted, vertex.crossing.beyond, out.media);
  }
  const F8 side = dot(out.direction, vertex.facing);
  const M8 wrong = select(sample.transmitted, side > F8(0.0f), side < F8(0.0f));  // never where `side` is no number
  go_on(out, and_not(lanes, wrong), vertex.bounce);
}

template <class Bsdf>
void Batch::shade_scattering(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
  const Path8& in = vertex.in;
  M8 lit = lanes;
  if (connects()) {
    gather_deposits(vertex, bsdf, wo, lanes);
    connect(vertex, bsdf, wo, lanes);
  } else if (light_pass_ != nullptr) {
    lit = lanes &
          (photons_bring_all() ? lamps_beside_photons<Bsdf>(vertex) : (in.chain == U8(kFromEye)) | ~vertex.casters);
    gather_deposits(vertex, bsdf, wo, lanes);
  }
  if (scene_.features().lights) {
    sample_light(vertex, bsdf, wo, lit);
  }
  const bool split_here = vertex.bounce == 0 && plan_.splits > 1;
  const std::uint32_t splits = split_here ? plan_.splits : 1;
  for (std::uint32_t split = 0; split < splits; ++split) {
    // From the first such surface on, a path has a point of its own in every sequence.
    const U8 index = vertex.bounce == 0 ? U8(plan_.split_index + split) : in.index;
    const Pair8 u = decide(index, in.pixel_seed, vertex.bounce, bsdf_decision(vertex.bounce));
    F8 choice(0.0f);
    if constexpr (Bsdf::kHasLobes) {
      choice = decide(index, in.pixel_seed, vertex.bounce, choice_decision(vertex.bounce)).v;
    }
    const BsdfSample8 s = bsdf.sample(wo, u, choice);
    Path8 out = in;
    out.index = index;
    out.slot = in.slot + U8(split * pixels_);
    out.throughput = in.throughput * s.weight * F8(1.0f / static_cast<float>(splits));
    out.roulette_scale = in.roulette_scale * F8(static_cast<float>(splits));
    if constexpr (requires { Bsdf::kEndsPaths; }) {
      out.roulette_scale = F8(std::numeric_limits<float>::infinity());  // see goes_on
    }
    if (connects()) {
      const F8 cosine = abs(dot(vertex.frame.to_world(s.wi), vertex.facing));
      const F8 back = vcm::pdf_back(scene_, vertex.surface, vertex.crossing, bsdf, wo, s.wi, lanes);
      out.partial = vcm::select(s.pdf_solid_angle > F8(0.0f),
                                vcm::scatter(vertex.partial, vertex.merging, cosine, s.pdf_solid_angle, back),
                                vcm::scatter_delta(vertex.partial, cosine));
    }
    if constexpr (Bsdf::kLosesSamples) {
      leave(vertex, s, out, and_not(lanes, max_component(s.weight) <= F8(0.0f)));
    } else {
      leave(vertex, s, out, lanes);
    }
  }
}

template <class Bsdf>
void Batch::sample_light(const Vertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes) {
  const Path8& in = vertex.in;
  const std::uint32_t bounce = vertex.bounce;
  V8 origin = vertex.surface.point + vertex.facing * vertex.surface.offset;
  const LightSample8 light = draw_light(origin, in.index, in.pixel_seed, bounce);
  const V8 wi = vertex.frame.to_local(light.wi);
  const F8 side = dot(light.wi, vertex.facing);
  M8 valid = lanes & light.valid;
  if constexpr (Bsdf::kTransmits) {
    // Both normals must agree on which side the light is; the shadow ray starts on that side.
    valid = valid & (((wi.z > F8(0.0f)) & (side > F8(0.0f))) | ((wi.z < F8(0.0f)) & (side < F8(0.0f))));
    origin = vertex.surface.point + vertex.facing * copysign(vertex.surface.offset, side);
  } else {
    valid = valid & (wi.z > F8(0.0f)) & (side > F8(0.0f));
  }
  if (valid.none()) {
    return;
  }
  const F8 weight = connects() ? sampled_light_weight(vertex, bsdf, wo, wi, light, valid)
                               : select(light.pdf_solid_angle > F8(0.0f),
                                        mis_weight(light.pdf_solid_angle, bsdf.pdf_solid_angle(wo, wi)), F8(1.0f));
  const V8 contribution = in.throughput * bsdf.eval(wo, wi) * light.weight * weight;
  if constexpr (Bsdf::kLosesSamples) {
    valid = and_not(valid, max_component(contribution) <= F8(0.0f));
  }
  Media8 media = in.media;
  if constexpr (Bsdf::kTransmits) {
    media = select(wi.z < F8(0.0f), vertex.crossing.beyond, media);
  }
  ws_.shadows.push(valid, {origin, light.point - origin, contribution, shadow_slot(in.slot, light, valid), media});
}

}  // namespace lightmill::path
