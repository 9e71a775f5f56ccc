// Deterministic direct light of all lights, with hard shadows.
//
//   - Point, spot, cosine-power, IES and directional lights are evaluated as they are.
//   - Emissive objects act as points (lights/emitter_points.h). They cast no shadows in their own light, and do not
//     light themselves.
//   - Emissive planes, spheres with an emission texture, and emitters whose opacity varies are visible but light
//     nothing.
//   - The environment is the background. It also lights every surface evenly and without shadows, as if its mean
//     radiance came from everywhere: albedo · mean. This is exact for a uniform sky over a convex diffuse shape.
//   - Mirrors, and smooth metal, glass and layers of principled materials, scatter none of this. Their reflections and
//     refractions are the `smooth` of their BSDF (materials/bsdf.h).
#pragma once

#include "common/methods/shading_frame.h"
#include "common/methods/transmittance.h"

namespace lightmill {

/// Eight rays at the surfaces that they hit.
struct LitVertex8 : ShadingFrame8 {
  V8 direction;  ///< of the rays, unit
  Surface8 surface;
  U8 geometry;
  Media8 media;        ///< of the rays, in scenes with media
  Crossing8 crossing;  ///< at the surfaces, in scenes with media
};

/// Immutable. Refers to the scene.
class LocalShading {
 public:
  /// `flat`: surfaces are shaded with their geometric normals.
  LocalShading(const CompiledScene& scene, bool flat);

  LitVertex8 vertex(const Arrival8& arrival, const Surface8& surface) const;
  /// Radiance of the environment for rays that leave the scene.
  V8 background(const V8& direction, M8 lanes) const;
  /// Radiance that the surfaces emit towards the rays' origins.
  V8 emission(const LitVertex8& vertex, M8 lanes) const;
  /// Radiance of lights that the surfaces scatter.
  V8 scattered(const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const;
  Principled8 principled(const LitVertex8& vertex, const V8& wo, M8 lanes) const;

 private:
  V8 scattered_by(MaterialKind kind, const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const;
  V8 shadow_catcher(const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const;
  enum class Shadows { cast, none };
  template <class Bsdf>
  V8 lit(const LitVertex8& vertex, const Bsdf& bsdf, const V8& wo, M8 lanes, RenderCounters& counters,
         Shadows shadows = Shadows::cast) const;
  template <class Bsdf>
  V8 lit_by(const LightSample8& light, std::uint32_t object, const LitVertex8& vertex, const Bsdf& bsdf, const V8& wo,
            M8 lanes, RenderCounters& counters, Shadows shadows) const;
  V8 arriving(M8 lanes, const V8& origin, const V8& way, const Media8& media, std::uint32_t object,
              RenderCounters& counters) const;

  const CompiledScene* scene_;
  bool flat_;
  V8 ambient_;  ///< the environment's mean radiance
};

}  // namespace lightmill
