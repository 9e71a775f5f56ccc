#include "common/scene/compiled/normal_maps.h"

#include "common/math/transcendental.h"
#include "common/scene/compiled/scalar_channel.h"

namespace lightmill {

NormalMaps::NormalMaps(const Scene& scene, const MaterialRows& rows, double length_scale) {
  for (const auto& material : rows.materials) {
    const NormalMap& normal = material->normal_map;
    const BumpMap& bump = material->bump_map;
    // The right side of an image is where its own first coordinate grows. This is −u if the image is scaled by a
    // negative factor, and another direction if it is rotated.
    std::array<double, 2> sign{1, 1};
    double angle = 0;
    if (normal.texture != kNoTexture) {
      const TextureImage& image = scene.textures[normal.texture];
      sign = {image.scale[0] < 0 ? -1.0 : 1.0, image.scale[1] < 0 ? -1.0 : 1.0};
      angle = image.rotation_degrees * kPiDouble / 180;
    }
    normals_.push_back(normal.texture);
    cosine_.push_back(static_cast<float>(cos_fixed(angle)));
    sine_.push_back(static_cast<float>(sin_fixed(angle)));
    scale_u_.push_back(static_cast<float>(normal.scale * sign[0]));
    scale_v_.push_back(static_cast<float>(normal.scale * sign[1]));
    heights_.push_back(bump.map.texture);
    channel_.push_back(static_cast<std::uint32_t>(bump.map.channel));
    height_.push_back(static_cast<float>(bump.height * length_scale));
  }
}

void NormalMaps::apply(const GeometryTable& geometry, const TextureSet& textures, const Hit8& hits,
                       Surface8& surface) const {
  const M8 bumpy = and_not(surface.mapped, heights_.at(surface.material, surface.mapped) == U8(TextureSet::kNone));
  const M8 textured = and_not(surface.mapped, bumpy);
  Tangents8 tangents = geometry.derivatives(hits, surface, surface.mapped);
  V8 n = surface.shading_normal;
  if (bumpy.any()) {
    n = select(bumpy, bumps(textures, tangents, surface, bumpy), n);
  }
  if (textured.any()) {
    geometry.use_vertex_tangents(hits, surface, textured, tangents);
    n = select(textured, normals(textures, tangents, surface, textured), n);
  }
  const F8 length2 = length_squared(n);
  const M8 usable = surface.mapped & (length2 > F8(0.0f)) & (length2 < F8(std::numeric_limits<float>::infinity()));
  n = n * (F8(1.0f) / sqrt(length2));
  // Moves normals off the horizon, along the geometric normal.
  const V8& up = surface.geometric_normal;
  const F8 cosine = dot(n, up), sine2 = max(F8(1.0f) - cosine * cosine, F8(0.0f));
  const M8 low = cosine < F8(kMinCosine);
  const F8 shrink = select(sine2 > F8(0.0f), F8(std::sqrt(1 - kMinCosine * kMinCosine)) / sqrt(sine2), F8(0.0f));
  n = select(low, normalize((n - up * cosine) * shrink + up * F8(kMinCosine)), n);
  surface.shading_normal = select(usable, n, surface.shading_normal);
}

V8 NormalMaps::normals(const TextureSet& textures, const Tangents8& tangents, const Surface8& surface, M8 lanes) const {
  const V8& n = surface.shading_normal;
  const V8 along = tangents.u - n * dot(n, tangents.u);
  const F8 length2 = length_squared(along);
  const V8 t = along * (F8(1.0f) / sqrt(length2));
  const V8 across = cross(n, t);
  const V8 b = across * copysign(F8(1.0f), dot(across, tangents.v));
  const V8 texel = textures.lookup(normals_.at(surface.material, lanes), surface.u, surface.v, lanes).rgb;
  const auto part = [](F8 value) { return value * F8(2.0f) - F8(1.0f); };
  const F8 cosine = cosine_.at(surface.material, lanes), sine = sine_.at(surface.material, lanes);
  const F8 x = part(texel.x), y = part(texel.y);
  const F8 along_u = x * cosine + y * sine, along_v = y * cosine - x * sine;
  const V8 mapped = t * (along_u * scale_u_.at(surface.material, lanes)) +
                    b * (along_v * scale_v_.at(surface.material, lanes)) + n * part(texel.z);
  return select(length2 > F8(0.0f), mapped, n);
}

V8 NormalMaps::bumps(const TextureSet& textures, const Tangents8& tangents, const Surface8& surface, M8 lanes) const {
  const V8& n = surface.shading_normal;
  const V8 by_u = cross(tangents.v, n), by_v = cross(n, tangents.u);  // gradients of u and v, times `area`
  const F8 area = dot(tangents.u, by_u);
  const Texture::Slopes8 slopes = textures.slopes(heights_.at(surface.material, lanes), surface.u, surface.v, lanes);
  const U8 channel = channel_.at(surface.material, lanes);
  const F8 scale = height_.at(surface.material, lanes) / area;
  const V8 mapped = n - by_u * (channel_of(slopes.u, channel) * scale) - by_v * (channel_of(slopes.v, channel) * scale);
  return select(abs(area) > F8(0.0f), mapped, n);
}

}  // namespace lightmill
