#include "common/planner/scene_facts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include "common/base/overloaded.h"
#include "common/base/text.h"
#include "common/materials/conductor.h"
#include "common/materials/mean_reflectance.h"
#include "common/math/transcendental.h"
#include "common/math/vec.h"
#include "common/planner/narrow_lobes.h"
#include "common/planner/regions.h"
#include "common/scene/casters.h"
#include "common/scene/mesh.h"

namespace lightmill {
namespace {

constexpr double kLosesNothing = 0.999999;

/// "the glass 'ball'".
std::string named(std::string_view what, const std::string& name) {
  return name.empty() ? fmt::format("a {}", what) : fmt::format("the {} '{}'", what, printable(name));
}

std::string_view noun_of(const Material& material) {
  if (is_glass(material)) {
    return "glass";
  }
  return std::visit(
      Overloaded{[](const MirrorMaterial&) { return "mirror"; }, [](const ConductorMaterial&) { return "metal"; },
                 [](const PrincipledMaterial& m) { return m.metallic > 0 ? "metal" : "surface"; },
                 [](const OneOf<DiffuseMaterial, DielectricMaterial, PhongMaterial, ShadowCatcherMaterial,
                                MixtureMaterial> auto&) { return "surface"; }},
      material.kind);
}

/// Albedo of the diffuse part of a principled material, on both sides.
std::array<double, 3> diffuse_bound(const PrincipledMaterial& m) {
  const RgbColor &base = m.base_color.rgb, &through = m.transmittance.rgb;
  const auto both = [](double reflected, double transmitted) { return transmitted + (1 - transmitted) * reflected; };
  return {both(base.r, through.r), both(base.g, through.g), both(base.b, through.b)};
}

/// What the gloss or a coat reflects of uniform light, or more.
double gloss_bound(const PrincipledMaterial& m) {
  const double root = std::abs(m.ior - 1) / (m.ior + 1) * std::sqrt(std::max(2 * m.specular, 1.0));
  const double of_gloss = root < 1 ? dielectric::mean_reflectance((1 + root) / (1 - root)) : 1;
  const double of_coat = m.coat > 0 ? dielectric::mean_reflectance(1.5) : 0;
  return std::max(of_gloss * std::min(2 * m.specular, 1.0), of_coat);
}

/// The gloss is added to the diffuse part.
std::array<double, 3> burley_bound(const PrincipledMaterial& m) {
  constexpr double kMaxDiffuse = 1.07;  // in uniform light, at roughness 1
  const double gloss = gloss_bound(m);
  const std::array<double, 3> base = diffuse_bound(m);
  return {base[0] * kMaxDiffuse + gloss, base[1] * kMaxDiffuse + gloss, base[2] * kMaxDiffuse + gloss};
}

/// Upper bound of the albedo without a sheen, by channel.
std::array<double, 3> principled_bound(const PrincipledMaterial& m) {
  if (m.burley_diffuse) {
    return burley_bound(m);
  }
  // A white coat or gloss raises a dark base.
  const bool layers = m.coat > 0 || m.specular > 0;
  const std::array<double, 3> base = diffuse_bound(m);
  const auto bound = [&](double of_base) { return layers ? std::max(of_base, double{0.04f}) : of_base; };
  return {bound(base[0]), bound(base[1]), bound(base[2])};
}

/// The same with its sheen, which reduces the base by the reflectance of the largest component of its colour.
std::array<double, 3> with_sheen(const PrincipledMaterial& m, const std::array<double, 3>& base) {
  constexpr double kMaxSheen = 0.3;  // of white sheen in uniform light, at roughness 1
  const RgbColor& c = m.sheen_color.rgb;
  const double taken = kMaxSheen * std::max({c.r, c.g, c.b});
  const auto bound = [&](double below, float sheen) {
    return std::max(below, kMaxSheen * sheen + (1 - taken) * below);
  };
  return {bound(base[0], c.r), bound(base[1], c.g), bound(base[2], c.b)};
}

/// Upper bound of a surface's albedo, by channel.
std::array<double, 3> albedo_of(const Material& material) {
  const auto of = [](const RgbColor& c) { return std::array<double, 3>{c.r, c.g, c.b}; };
  return std::visit(
      Overloaded{[&](const DiffuseMaterial& m) {
                   const RgbColor &r = m.reflectance.rgb, &t = m.transmittance.rgb;
                   return of({std::min(r.r + t.r, 1.0f), std::min(r.g + t.g, 1.0f), std::min(r.b + t.b, 1.0f)});
                 },
                 [&](const MirrorMaterial& m) { return of(m.reflectance.rgb); },
                 [&](const DielectricMaterial&) {
                   return std::array<double, 3>{1, 1, 1};
                 },
                 [&](const PhongMaterial& m) {
                   const RgbColor &d = m.diffuse.rgb, &s = m.specular.rgb;
                   return of({d.r + s.r, d.g + s.g, d.b + s.b});
                 },
                 [&](const ConductorMaterial& m) {
                   const auto at_normal = conductor::normal_reflectance<double>;
                   return std::array<double, 3>{at_normal(m.eta.r, m.k.r), at_normal(m.eta.g, m.k.g),
                                                at_normal(m.eta.b, m.k.b)};
                 },
                 [&](const PrincipledMaterial& m) { return with_sheen(m, principled_bound(m)); },
                 [](const ShadowCatcherMaterial&) { return std::array<double, 3>{}; },
                 [](const MixtureMaterial& m) {
                   const std::array<double, 3> a = albedo_of(*m.first), b = albedo_of(*m.second);
                   return std::array<double, 3>{std::max(a[0], b[0]), std::max(a[1], b[1]), std::max(a[2], b[2])};
                 }},
      material.kind);
}

bool is_textured(const Material& material) {
  return has_maps(material) ||
         std::ranges::any_of(colors_of(material), [](const auto* color) { return color->texture != kNoTexture; });
}

bool has_sheen(const Material& material) {
  return any_part(material, [](const Material& part) {
    const auto* const principled = std::get_if<PrincipledMaterial>(&part.kind);
    return principled != nullptr && !is_black(principled->sheen_color);
  });
}

bool loses_light_between_facets(const Material& material) {
  const auto is_rough = [](const auto& m) {
    if constexpr (requires { m.roughness; }) {
      return m.roughness > 0;
    }
    return false;
  };
  return any_part(material,
                  [&](const Material& part) { return part.single_scattering && std::visit(is_rough, part.kind); });
}

/// Facts of the materials in use.
struct Materials {
  std::array<bool, 3> kept{true, true, true};  ///< channels that no surface absorbs
  bool index_changes = false;                  ///< light enters a shape with another index
};

void read_material(const Material& material, SceneFacts& facts, Materials& all) {
  const std::array<double, 3> albedo = albedo_of(material);
  const bool textured = is_textured(material);
  facts.normal_maps = facts.normal_maps || has_mapped_normals(material);
  facts.anisotropy = facts.anisotropy || is_anisotropic(material);
  facts.sheen = facts.sheen || has_sheen(material);
  facts.mixtures = facts.mixtures || std::holds_alternative<MixtureMaterial>(material.kind);
  facts.thin_sheets = facts.thin_sheets || is_sheet(material);
  facts.textures =
      facts.textures || textured || has_mapped_normals(material) || material.opacity.map.texture != kNoTexture;
  facts.shadow_catchers = facts.shadow_catchers || std::holds_alternative<ShadowCatcherMaterial>(material.kind);
  if (uniform_opacity(material.opacity) != 1) {
    facts.see_through.add(named("material", material.name));
  }
  const RgbColor& absorbed = material.interior.absorption;
  for (const auto& [channel, sigma] : {std::pair{0, absorbed.r}, {1, absorbed.g}, {2, absorbed.b}}) {
    const auto at = static_cast<std::size_t>(channel);
    facts.largest_albedo = std::max(facts.largest_albedo, albedo[at]);
    all.kept[at] =
        all.kept[at] && albedo[at] >= kLosesNothing && !textured && sigma == 0 && !loses_light_between_facets(material);
  }
  facts.absorption = facts.absorption || !is_black(absorbed);
  facts.scattering = facts.scattering || !is_black(material.interior.scattering);
  const bool nothing_there = is_glass(material) && ior_of(material) == 1;
  facts.ranked_media = facts.ranked_media || material.priority != 0 || nothing_there;
  all.index_changes = all.index_changes || (is_boundary(material) && inner_ior(material) != 1);
}

/// Whether next-event estimation never samples the emitter, so that only rays that happen to hit it find its light.
bool is_never_sampled(const Object& object, const Material& material) {
  return std::holds_alternative<PlaneShape>(object.shape) || !uniform_opacity(material.opacity) ||
         (material.emission.texture != kNoTexture && std::holds_alternative<SphereShape>(object.shape));
}

void read_object(const Object& object, const Scene& scene, bool index_changes, SceneFacts& facts) {
  const Material& material = scene.materials[object.material];
  const bool plane = std::holds_alternative<PlaneShape>(object.shape);
  facts.planes = facts.planes || plane;
  if (!is_black(material.emission.rgb)) {
    ++facts.emissive_objects;
    if (is_never_sampled(object, material)) {
      facts.unsampled_emitters.add(named(plane                                               ? "plane"
                                         : std::holds_alternative<SphereShape>(object.shape) ? "sphere"
                                                                                             : "emitter",
                                         object.name.empty() ? material.name : object.name));
    }
  }
  facts.boundaries += is_boundary(material) ? 1 : 0;
  const bool plain_glass = std::holds_alternative<DielectricMaterial>(material.kind);
  if (plain_glass && ior_of(material) == 1 && !index_changes) {
    return;  // it does not affect light
  }
  const std::string name = named(noun_of(material), object.name.empty() ? material.name : object.name);
  const bool caster = is_caster(material);
  if (caster) {
    facts.casters.add(name);
    if (plane) {
      facts.infinite_casters.add(name);
    }
  }
  if (const NarrowLobes narrow = narrow_lobes(material); narrow != NarrowLobes::none) {
    (caster ? facts.smooth_casters : facts.smooth_layers).add(name);
    if (plane && !caster) {
      facts.infinite_layers.add(name);
    }
  }
  facts.receivers = facts.receivers || receives_light(material);
}

void read_small_emitters(const Scene& scene, Positions& positions, SceneFacts& facts) {
  const Regions narrow = positions.narrow_regions();
  const Regions receivers = facts.unsampled_emitters.empty() ? Regions{} : positions.receiver_regions();
  for (const Object& emitter : scene.objects) {
    const Material& material = scene.materials[emitter.material];
    if (is_black(material.emission.rgb)) {
      continue;
    }
    const std::optional<Extent>& extent = positions.extent_of(emitter);
    if (!extent) {
      continue;
    }
    const bool sampled = !is_never_sampled(emitter, material);
    if (positions.is_small_from(narrow, &emitter, *extent) ||
        (!sampled && positions.is_small_from(receivers, &emitter, *extent))) {
      (sampled ? facts.small_emitters : facts.hidden_emitters)
          .add(named("emitter", emitter.name.empty() ? material.name : emitter.name));
    }
  }
}

double pixel_share_of(const Scene& scene, Positions& positions) {
  const double angle = 2 * std::tan(scene.camera.vertical_fov_degrees * kPiDouble / 360) / scene.film.height;
  const double inside = angle * angle / 4;
  if (inside > kSmallShare) {
    return inside;  // meshes need not be read, because only a small share matters
  }
  Vec3d low(std::numeric_limits<double>::max()), high = -low;
  for (const Object& object : scene.objects) {
    if (const std::optional<Extent>& extent = positions.extent_of(object)) {
      low = glm::min(low, extent->center - extent->radius);
      high = glm::max(high, extent->center + extent->radius);
    }
  }
  if (low.x > high.x) {
    return inside;
  }
  const Point3d& eye = scene.camera.eye;
  const double radius = glm::length(high - low) / 2;
  const double distance = glm::length(Vec3d(eye[0], eye[1], eye[2]) - (low + high) / 2.0);
  return inside * std::max(distance * distance / (radius * radius), 1.0);
}

Vec3d vector(const Point3d& p) {
  return {p[0], p[1], p[2]};
}

/// `narrow`: all objects that scatter narrowly, if their positions are known.
void read_light(const Light& light, const Regions& narrow, Positions& positions, SceneFacts& facts) {
  const auto delta = [&](std::string_view what, bool dark) {
    if (!dark) {
      facts.delta_lights.add(named(what, light.name));
    }
  };
  const auto sized = [&](std::string_view what, bool dark, bool small) {
    if (!dark) {
      ++facts.sized_lights;
      if (small) {
        facts.small_emitters.add(named(what, light.name));
      }
    }
  };
  const auto ball = [&](std::string_view what, bool dark, const Point3d& at, double radius) {
    if (radius > 0) {
      const Extent extent{vector(at), radius, kPiDouble * radius * radius};
      sized(what, dark, positions.is_small_from(narrow, nullptr, extent));
    } else {
      delta(what, dark);
    }
  };
  std::visit(
      Overloaded{[&](const PointLight& l) { ball("point light", is_black(l.intensity), l.position, l.radius); },
                 [&](const DirectionalLight& l) {
                   const double share = one_minus_cos_fixed(l.angle_degrees * kPiDouble / 360) / 2;
                   if (share > 0) {
                     sized("directional light", is_black(l.irradiance), share < kSmallShare);
                   } else {
                     delta("directional light", is_black(l.irradiance));
                   }
                   if (!is_black(l.irradiance)) {
                     facts.distant_lights.add(named("directional light", light.name));
                   }
                 },
                 [&](const SpotLight& l) {
                   ball("spot light", is_black(l.intensity) || !positions.reaches(l, narrow), l.position, l.radius);
                 },
                 [&](const CosinePowerLight& l) { delta("cosine light", is_black(l.intensity)); },
                 [&](const DiskLight& l) {
                   const double reach =
                       l.rectangular ? std::hypot(l.radius, l.second_radius) : std::max(l.radius, l.second_radius);
                   const Extent extent{vector(l.position), reach, l.area()};
                   sized(l.rectangular ? "rectangle light" : "disk light", is_black(l.radiance),
                         positions.is_small_from(narrow, nullptr, extent));
                 },
                 [&](const IesLight& l) { delta("IES light", !(l.scale > 0)); },
                 [&](const EnvironmentLight& l) {
                   if (!is_black(l.radiance)) {
                     facts.environment =
                         l.has_image ? SceneFacts::Environment::image : SceneFacts::Environment::constant;
                     if (l.has_image) {
                       facts.distant_lights.add(named("environment", light.name));
                     }
                   }
                 }},
      light.kind);
}

bool is_surface_meter(const Meter& meter) {
  return !std::holds_alternative<RadianceMeter>(meter.kind);
}

}  // namespace

void NamedItems::add(std::string name) {
  ++count;
  if (names.size() < kMaxNames) {
    names.push_back(std::move(name));
  }
}

std::string NamedItems::text() const {
  if (empty()) {
    return "none";
  }
  const std::size_t more = count - names.size();
  if (more > 0) {
    return fmt::format("{} and {} more", fmt::join(names, ", "), more);
  }
  return count == 1 ? names.front()
                    : fmt::format("{} and {}", fmt::join(names.begin(), names.end() - 1, ", "), names.back());
}

SceneFacts read_facts(const Scene& scene, const MeshSource& meshes) {
  SceneFacts facts;
  Positions positions(scene, meshes);
  const bool local = std::ranges::any_of(scene.lights, [](const Light& light) {
    const auto* const point = std::get_if<PointLight>(&light.kind);
    return std::holds_alternative<SpotLight>(light.kind) || std::holds_alternative<DiskLight>(light.kind) ||
           (point != nullptr && point->radius > 0);
  });
  const Regions narrow_for_lights = local ? positions.narrow_regions() : Regions{};
  for (const Light& light : scene.lights) {
    read_light(light, narrow_for_lights, positions, facts);
  }
  Materials all;
  std::vector<bool> seen(scene.materials.size());
  for (const Object& object : scene.objects) {
    if (!seen[object.material]) {
      seen[object.material] = true;
      read_material(scene.materials[object.material], facts, all);
    }
  }
  for (const Object& object : scene.objects) {
    read_object(object, scene, all.index_changes, facts);
  }
  const bool narrow = !facts.smooth_casters.empty() || !facts.smooth_layers.empty();
  if (facts.emissive_objects > 0 && (narrow || !facts.unsampled_emitters.empty())) {
    read_small_emitters(scene, positions, facts);
  }
  facts.pixel_share = pixel_share_of(scene, positions);
  facts.steps = positions.steps();
  facts.lens = scene.camera.lens_radius > 0;
  facts.meters = scene.meters.size();
  for (const Meter& meter : scene.meters) {
    if (std::holds_alternative<IrradianceMeter>(meter.kind)) {
      facts.point_meters.add(named("point meter", meter.name));
    }
  }
  facts.receivers = facts.receivers || facts.scattering || std::ranges::any_of(scene.meters, is_surface_meter);
  facts.lossless = std::ranges::any_of(all.kept, std::identity{});
  return facts;
}

std::vector<std::string> features_of(const SceneFacts& facts) {
  std::vector<std::string> features;
  const auto add = [&](bool there, std::string_view feature) {
    if (there) {
      features.emplace_back(feature);
    }
  };
  using Environment = SceneFacts::Environment;
  add(!facts.delta_lights.empty() || facts.sized_lights > 0 || facts.emissive_objects > 0 ||
          facts.environment != Environment::none,
      "light sampling");
  add(facts.sized_lights > 0, "lights with a size");
  add(facts.emissive_objects > 0, "emissive surfaces");
  add(facts.environment == Environment::constant, "constant environment");
  add(facts.environment == Environment::image, "environment image");
  const bool media = facts.absorption || facts.scattering || facts.ranked_media;
  add(media, "media");
  add(!media && facts.boundaries > 1, "media, if glass may overlap");
  add(facts.absorption, "absorption");
  add(facts.scattering, "scattering");
  add(facts.textures, "textures");
  add(!facts.see_through.empty(), "opacity");
  add(facts.normal_maps, "normal maps");
  add(facts.anisotropy, "anisotropy");
  add(facts.sheen, "sheen");
  add(facts.mixtures, "mixtures");
  add(facts.thin_sheets, "sheets that transmit light");
  add(facts.shadow_catchers, "shadow catchers");
  add(facts.lens, "lens");
  add(facts.meters > 0, "meters");
  return features;
}

}  // namespace lightmill
