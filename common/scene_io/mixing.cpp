#include "common/scene_io/mixing.h"

namespace lightmill {
namespace {

const DiffuseMaterial* plain_diffuse(const Material& material) {
  const auto* diffuse = std::get_if<DiffuseMaterial>(&material.kind);
  return diffuse != nullptr && diffuse->reflectance.texture == kNoTexture && diffuse->roughness == 0 &&
                 is_black(diffuse->transmittance)
             ? diffuse
             : nullptr;
}

/// Whether light passes as if there were no surface.
bool is_nothing(const Material& material) {
  const auto* dielectric = std::get_if<DielectricMaterial>(&material.kind);
  return dielectric != nullptr && dielectric->ior == 1;
}

std::shared_ptr<const Material> part_of(const Material& material) {
  Material out;
  out.kind = material.kind;
  out.roughness_map = material.roughness_map;
  out.metallic_map = material.metallic_map;
  out.single_scattering = material.single_scattering;
  return std::make_shared<const Material>(std::move(out));
}

}  // namespace

Result<Material> mixed(const Material& first, const Material& second, double factor, const ScalarMap& map,
                       Notices& notices) {
  if (is_nothing(first) != is_nothing(second)) {
    Material shown = is_nothing(first) ? second : first;
    if (is_boundary(shown) || shown.opacity.mode != Opacity::Mode::opaque) {
      return invalid_argument("glass and transparent materials cannot be mixed with one that light passes unchanged");
    }
    if (is_nothing(second) && map.texture != kNoTexture) {
      return invalid_argument(
          "a texture cannot be the share of a material that light passes unchanged. Exchange the two materials, and "
          "invert the texture");
    }
    shown.opacity = {Opacity::Mode::blend, is_nothing(first) ? factor : 1 - factor, map};
    return shown;
  }
  if (is_boundary(first) && is_boundary(second) && inner_ior(first) != inner_ior(second)) {
    return invalid_argument("glass with different indices of refraction cannot be mixed");
  }
  if (!(first.opacity == second.opacity)) {
    return invalid_argument("materials with different opacity cannot be mixed");
  }
  Material out;
  out.opacity = first.opacity;
  if (first.normal_map == second.normal_map && first.bump_map == second.bump_map) {
    out.normal_map = first.normal_map;
    out.bump_map = first.bump_map;
  } else {
    notices.left_out("normal maps and bump maps of mixed materials that have different ones");
  }
  const DiffuseMaterial *a = plain_diffuse(first), *b = plain_diffuse(second);
  if (a != nullptr && b != nullptr && map.texture == kNoTexture) {
    const auto t = static_cast<float>(factor);
    const auto mean = [&](float x, float y) { return x * (1 - t) + y * t; };
    const RgbColor &x = a->reflectance.rgb, &y = b->reflectance.rgb;
    out.kind = DiffuseMaterial{{mean(x.r, y.r), mean(x.g, y.g), mean(x.b, y.b)}};
    return out;
  }
  if (const std::size_t parts = count_parts(first) + count_parts(second); parts > kMaxMixtureParts) {
    return invalid_argument("at most {} materials can be mixed, got {}", kMaxMixtureParts, parts);
  }
  out.kind = MixtureMaterial{part_of(first), part_of(second), factor, map};
  return out;
}

}  // namespace lightmill
