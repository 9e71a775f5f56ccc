#include "common/methods/raycast/local_shading.h"

#include "common/methods/surface_bsdf.h"

namespace lightmill {

LocalShading::LocalShading(const CompiledScene& scene, bool flat)
    : scene_(&scene), flat_(flat), ambient_(broadcast(Vec3(scene.lights().environment.mean_radiance()))) {}

LitVertex8 LocalShading::vertex(const Arrival8& arrival, const Surface8& surface) const {
  LitVertex8 out{ShadingFrame8(surface), arrival.rays.direction, surface,
                 arrival.hits.geometry,  arrival.media,          arrival.crossing};
  if (flat_) {
    const V8& n = surface.geometric_normal;
    out.surface.shading_normal = n;
    out.surface.mapped = M8();
    if (surface.directed.any()) {
      out.surface.tangent = normalize(surface.tangent - n * dot(n, surface.tangent));
    }
    static_cast<ShadingFrame8&>(out) = ShadingFrame8(out.surface);
  }
  return out;
}

V8 LocalShading::background(const V8& direction, M8 lanes) const {
  return scene_->features().environment ? masked(lanes, scene_->lights().environment.radiance(direction)) : V8();
}

V8 LocalShading::emission(const LitVertex8& vertex, M8 lanes) const {
  if (!scene_->features().emissive_surfaces) {
    return {};
  }
  const M8 emitting = scene_->materials().emits(vertex.surface, lanes);
  const F8 cosine = abs(dot(vertex.direction, vertex.surface.geometric_normal));
  return masked(emitting, scene_->materials().emission(vertex.surface, cosine, emitting));
}

Principled8 LocalShading::principled(const LitVertex8& vertex, const V8& wo, M8 lanes) const {
  return {scene_->materials().principled(vertex.surface, lanes),
          relative_index(*scene_, vertex.surface, vertex.crossing, lanes), wo, vertex.surface.front};
}

V8 LocalShading::scattered(const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const {
  V8 sum;
  for_each_kind(scene_->materials(), vertex.surface, lanes,
                [&](MaterialKind kind, M8 of_kind) { sum = sum + scattered_by(kind, vertex, of_kind, counters); });
  return sum;
}

V8 LocalShading::scattered_by(MaterialKind kind, const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const {
  const MaterialTable& materials = scene_->materials();
  const Surface8& surface = vertex.surface;
  const V8 wo = vertex.wo(-vertex.direction);
  V8 albedo = materials.albedo(surface, lanes);  // of the rough lobes
  V8 light;
  switch (kind) {
    case MaterialKind::mirror:
    case MaterialKind::dielectric:
    case MaterialKind::conductor:
    case MaterialKind::mixture:
      return {};
    case MaterialKind::diffuse:
      light = lit(vertex, Diffuse8{albedo}, wo, lanes, counters);
      break;
    case MaterialKind::rough_diffuse: {
      const RoughDiffuse8 bsdf = materials.rough_diffuse(surface, lanes);
      albedo = bsdf.mean_albedo();
      light = lit(vertex, bsdf, wo, lanes, counters);
      break;
    }
    case MaterialKind::diffuse_transmission: {
      const DiffuseTransmission8 bsdf = materials.diffuse_transmission(surface, lanes);
      albedo = bsdf.reflectance + bsdf.transmittance;
      light = lit(vertex, bsdf, wo, lanes, counters);
      break;
    }
    case MaterialKind::phong: {
      const Phong8 bsdf = materials.phong(surface, lanes);
      light = lit(vertex, bsdf, wo, lanes, counters);
      break;
    }
    case MaterialKind::rough_conductor: {
      const Conductor8 bsdf = materials.conductor(surface, lanes);
      albedo = masked(bsdf.rough(), albedo);
      light = lit(vertex, bsdf, wo, lanes, counters);
      break;
    }
    case MaterialKind::rough_dielectric: {
      const RoughDielectric8 bsdf =
          materials.dielectric(surface, relative_index(*scene_, vertex.surface, vertex.crossing, lanes), lanes);
      albedo = masked(bsdf.rough(), albedo);
      light = lit(vertex, bsdf, wo, lanes, counters);
      break;
    }
    case MaterialKind::principled: {
      const Principled8 bsdf = principled(vertex, wo, lanes);
      albedo = bsdf.rough_albedo();
      light = lit(vertex, bsdf, wo, lanes, counters);
      break;
    }
    case MaterialKind::shadow_catcher:
      return shadow_catcher(vertex, lanes, counters);
  }
  return light + masked(lanes, albedo * ambient_);
}

/// The background times irradiance with shadows over irradiance without shadows.
V8 LocalShading::shadow_catcher(const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const {
  LitVertex8 flat = vertex;
  static_cast<ShadingFrame8&>(flat) = ShadingFrame8(vertex.facing);
  const V8 wo = flat.wo(-vertex.direction);
  const Diffuse8 meter{broadcast(Vec3(kPi))};
  const V8 ambient = ambient_ * F8(kPi);
  const V8 arriving = ambient + lit(flat, meter, wo, lanes, counters);
  const V8 unoccluded = ambient + lit(flat, meter, wo, lanes, counters, Shadows::none);
  const auto share = [](F8 part, F8 whole) { return select(whole > F8(0.0f), part / whole, F8(1.0f)); };
  const V8 background = scene_->lights().environment.radiance(vertex.direction);
  return masked(lanes, background * V8{share(arriving.x, unoccluded.x), share(arriving.y, unoccluded.y),
                                       share(arriving.z, unoccluded.z)});
}

template <class Bsdf>
V8 LocalShading::lit(const LitVertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes, RenderCounters& counters,
                     Shadows shadows) const {
  const V8 origin = vertex.surface.point + vertex.facing * vertex.surface.offset;
  const LightTable& table = scene_->lights();
  V8 sum;
  for (std::uint32_t i = table.first(LightKind::disk); i < table.first(LightKind::environment); ++i) {
    sum = sum + lit_by(table.sample_point(i, origin, lanes), kNoGeometry, vertex, bsdf, wo, lanes, counters, shadows);
  }
  const EmitterPoints& objects = scene_->emitter_points();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::uint32_t object = objects.geometry(i);
    const M8 others = and_not(lanes, vertex.geometry == U8(object));
    sum = sum + lit_by(objects.sample(i, origin, others), object, vertex, bsdf, wo, others, counters, shadows);
  }
  return sum;
}

/// Light of one light that the surfaces scatter.
template <class Bsdf>
V8 LocalShading::lit_by(const LightSample8& light, std::uint32_t object, const LitVertex8& vertex, const Bsdf& bsdf,
                        const V8& wo, M8 lanes, RenderCounters& counters, Shadows shadows) const {
  V8 scattered;
  vertex.for_each_wi<Bsdf>(light.wi, lanes & light.valid, [&](const V8& wi, M8 there) {
    scattered = scattered + masked(there, bsdf.eval(wo, wi) * light.weight);
  });
  const M8 lit = max_component(scattered) > F8(0.0f);
  scattered = masked(lit, scattered);
  if (shadows == Shadows::none || lit.none()) {
    return scattered;
  }
  // The shadow ray starts on the light's side.
  V8 origin = vertex.surface.point + vertex.facing * vertex.surface.offset;
  Media8 media = vertex.media;
  if constexpr (Bsdf::kTransmits) {
    const F8 side = dot(light.wi, vertex.facing);
    origin = vertex.surface.point + vertex.facing * copysign(vertex.surface.offset, side);
    media = select(side < F8(0.0f), vertex.crossing.beyond, media);
  }
  return scattered * arriving(lit, origin, light.point - origin, media, object, counters);
}

/// Transmittance from the point at `origin + way`; 0 in occluded lanes.
V8 LocalShading::arriving(M8 lanes, const V8& origin, const V8& way, const Media8& media, std::uint32_t object,
                          RenderCounters& counters) const {
  const auto white = [](M8 mask) { return masked(mask, broadcast(Vec3(1))); };
  if (object == kNoGeometry && !scene_->features().media) {
    counters.shadow_rays += static_cast<std::uint64_t>(lanes.count());
    const Ray8 rays{origin, way, F8(1.0f)};
    const M8 blocked = scene_->accel().occluded(lanes, rays);
    return white(and_not(lanes, blocked)) + broadcast(Vec3(1)) * share_passed(*scene_, blocked, rays, counters);
  }
  const F8 length = sqrt(length_squared(way));
  const Arrival8 arrival =
      trace_transmittance(*scene_, lanes, {origin, way * (F8(1.0f) / length), length}, media, {}, object, counters);
  return white(and_not(lanes, arrival.hits.hit)) * arrival.transmittance;
}

}  // namespace lightmill
