// Shading by the kind of a material: the templates of scattering.h for each BSDF that has a density, one way to go on
// for those that have none.
#include "common/materials/holdout.h"
#include "common/methods/path/scattering.h"
#include "common/methods/surface_bsdf.h"

namespace lightmill::path {

void Batch::shade_kind(MaterialKind kind, const Vertex8& vertex, M8 lanes) {
  const V8 wo = vertex.frame.to_local(-vertex.in.direction);
  visit_bsdf(scene_, kind, vertex.surface, vertex.crossing, wo, lanes, [&](const auto& bsdf, M8 visible) {
    using Bsdf = std::remove_cvref_t<decltype(bsdf)>;
    if constexpr (std::is_same_v<Bsdf, HoldoutSurface>) {
      shade_holdout(vertex, visible);
    } else if constexpr (requires { bsdf.eval(wo, wo); }) {
      shade_scattering(vertex, bsdf, wo, visible);
    } else if constexpr (requires { bsdf.sample(wo); }) {
      go_on_specular(vertex, specular_start(vertex), bsdf.sample(wo), visible);
    } else {
      const Path8 start = specular_start(vertex);
      const F8 u = decide(start.index, start.pixel_seed, vertex.bounce, bsdf_decision(vertex.bounce)).u;
      go_on_specular(vertex, start, bsdf.sample(wo, u), visible);
    }
  });
}

/// Its shading normal is the geometric one: light and what it is compared with come over the same horizon.
void Batch::shade_holdout(const Vertex8& vertex, M8 lanes) {
  const Path8& in = vertex.in;
  const V8 background = scene_.lights().environment.radiance(in.direction);
  const V8 unoccluded = scene_.unoccluded_irradiance(vertex.surface.point, vertex.facing, lanes);
  const auto unlit = [](F8 irradiance, F8 radiance) { return select(irradiance > F8(0.0f), F8(0.0f), radiance); };
  const V8 shown{unlit(unoccluded.x, background.x), unlit(unoccluded.y, background.y),
                 unlit(unoccluded.z, background.z)};
  if ((max_component(shown) > F8(0.0f)).any()) {  // where no light could come, there is no shadow
    add_background(in, lanes, shown, vertex.bounce);
  }
  const Vertex8 flat{in, vertex.surface, vertex.facing, Frame8(vertex.facing), vertex.bounce, vertex.crossing};
  shade_scattering(flat, Holdout8::showing(background, unoccluded), flat.frame.to_local(-in.direction), lanes);
}

/// A path that starts with a delta BSDF is not split: its points are those of the sample, under scrambles of its own.
Path8 Batch::specular_start(const Vertex8& vertex) {
  Path8 out = vertex.in;
  if (vertex.bounce == 0) {
    out.pixel_seed = mix(vertex.in.pixel_seed ^ U8(kUnsplitSalt));
  }
  return out;
}

void Batch::go_on_specular(const Vertex8& vertex, const Path8& start, const BsdfSample8& sample, M8 lanes) {
  Path8 out = start;
  out.throughput = out.throughput * sample.weight;
  if (connects()) {
    out.partial = vcm::scatter_delta(vertex.partial, abs(dot(vertex.frame.to_world(sample.wi), vertex.facing)));
  }
  leave(vertex, sample, out, lanes);
}

}  // namespace lightmill::path
