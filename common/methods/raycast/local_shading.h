// What surfaces show of all lights at once: without random numbers, with hard shadows.
//
// Every light is looped over: points, spots, cosine_power, ies and directional ones as they are, emissive objects as
// points (lights/hard_lights.h), which do not shade what they light, nor light themselves. Planes that emit, and
// spheres that do by a texture, are seen but light nothing. The environment is seen where rays leave the scene;
// besides, it lights every surface evenly and without shadows, as if its mean radiance came from everywhere: albedo ·
// mean, which is exact for an even sky over a convex diffuse shape. What is smooth, be it a mirror, metal, glass or a
// layer of a principled material, shows nothing of all this: what it shows is the `smooth` of its BSDF
// (materials/bsdf.h) to tell.
#pragma once

#include "common/methods/transmittance.h"

namespace lightmill {

/// Eight rays at the surfaces they have found.
struct LitVertex8 {
  V8 direction;  ///< of the rays, unit
  Surface8 surface;
  V8 facing;     ///< the geometric normal on the ray's side
  Frame8 frame;  ///< around the shading normal on the ray's side
  U8 geometry;
  Media8 media;        ///< that the rays are in, where the scene has such
  Crossing8 crossing;  ///< likewise
};

/// Immutable; refers to the scene.
class LocalShading {
 public:
  /// `flat`: surfaces are shaded with their geometric normals.
  LocalShading(const CompiledScene& scene, bool flat);

  LitVertex8 vertex(const Arrival8& arrival, const Surface8& surface) const;
  /// Radiance from where rays leave the scene.
  V8 background(const V8& direction, M8 lanes) const;
  /// Radiance that is emitted towards the rays' origins.
  V8 emission(const LitVertex8& vertex, M8 lanes) const;
  /// Radiance of lights that is scattered there.
  V8 scattered(const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const;
  Principled8 principled(const LitVertex8& vertex, const V8& wo, M8 lanes) const;

 private:
  V8 scattered_by(MaterialKind kind, const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const;
  V8 holdout(const LitVertex8& vertex, M8 lanes, RenderCounters& counters) const;
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
