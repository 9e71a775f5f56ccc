#include "common/lights/light_table.h"

#include "common/base/check.h"

namespace lightmill {
namespace {

constexpr double kMinPower = 1e-30;  ///< smallest power, intensity and irradiance in the choice

template <class Lights>
void append_bounds(const Lights& lights, std::vector<LightBounds>& out) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    out.push_back(lights.bounds(i));
    out.back().power = std::max(out.back().power, kMinPower);
    out.back().intensity = std::max(out.back().intensity, kMinPower);
  }
}

}  // namespace

void LightTable::build(bool equiangular) {
  const std::size_t counts[kKinds] = {facets.size(), spheres.size(),     disks.size(),
                                      points.size(), spots.size(),       cosine_powers.size(),
                                      ies.size(),    directional.size(), environment.samplable() ? std::size_t{1} : 0};
  for (int kind = 0; kind < kKinds; ++kind) {
    first_[kind + 1] = first_[kind] + static_cast<std::uint32_t>(counts[kind]);
  }
  std::vector<LightBounds> bounded;
  append_bounds(facets, bounded);
  append_bounds(spheres, bounded);
  append_bounds(disks, bounded);
  append_bounds(points, bounded);
  append_bounds(spots, bounded);
  append_bounds(cosine_powers, bounded);
  append_bounds(ies, bounded);
  std::vector<DistantBounds> distant;
  for (std::size_t i = 0; i < directional.size(); ++i) {
    distant.push_back(directional.bounds(i));
  }
  if (environment.samplable()) {
    distant.push_back({environment.irradiance()});
  }
  for (DistantBounds& light : distant) {
    light.irradiance = std::max(light.irradiance, kMinPower);
  }
  choice_ = LightChoice(bounded, distant);
  if (equiangular) {
    equiangular_ = EquiangularLights(bounded, distant);
  }
  draws_ = needs_choice() ? 1 : static_cast<std::uint32_t>(size());
  find_intersectable();
}

void LightTable::find_intersectable() {
  const auto find = [&](LightKind kind, const auto& lights) {
    for (std::size_t i = 0; i < lights.size(); ++i) {
      if (lights.has_size(i)) {
        intersectable_.push_back(first(kind) + static_cast<std::uint32_t>(i));
      }
    }
  };
  find(LightKind::disk, disks);
  find(LightKind::point, points);
  find(LightKind::spot, spots);
  find(LightKind::directional, directional);
  if (!intersectable_.empty()) {
    is_intersectable_.resize(size());
    for (const std::uint32_t light_index : intersectable_) {
      is_intersectable_[light_index] = 1;
    }
  }
}

LightSample8 LightTable::sample_of_kind(LightKind kind, const V8& p, U8 index, M8 lanes, Pair8 u) const {
  switch (kind) {
    case LightKind::facet:
      return facets.sample(p, index, lanes, u);
    case LightKind::sphere:
      return spheres.sample(p, index, lanes, u);
    case LightKind::disk:
      return disks.sample(p, index, lanes, u);
    case LightKind::point:
      return points.sample(p, index, lanes, u);
    case LightKind::spot:
      return spots.sample(p, index, lanes, u);
    case LightKind::cosine_power:
      return cosine_powers.sample(p, index, lanes);
    case LightKind::ies:
      return ies.sample(p, index, lanes);
    case LightKind::directional:
      return directional.sample(p, index, lanes, u);
    case LightKind::environment:
      return environment.sample(p, u);
  }
  LM_CHECK(false, "unknown kind of light");
}

LightKind LightTable::kind_of(std::uint32_t light) const {
  int kind = 0;
  while (light >= first_[kind + 1]) {
    ++kind;
  }
  return static_cast<LightKind>(kind);
}

LightSample8 LightTable::sample_light(std::uint32_t light, const V8& p, Pair8 u) const {
  const LightKind kind = kind_of(light);
  LightSample8 out = sample_of_kind(kind, p, U8(light - first(kind)), M8(true), u);
  out.light = U8(light);
  return out;
}

LightSample8 LightTable::sample_chosen(const V8& p, const LightChoice::Choice8& chosen, Pair8 u) const {
  LightSample8 result;
  M8 rest(true);
  for (int k = 0; k < kKinds && rest.any(); ++k) {
    const auto kind = static_cast<LightKind>(k);
    if (!has(kind)) {
      continue;
    }
    const M8 lanes = rest & signed_less(chosen.light, U8(first_[k + 1]));
    if (lanes.none()) {
      continue;
    }
    const LightSample8 drawn = sample_of_kind(kind, p, chosen.light - U8(first_[k]), lanes, u);
    result = rest.bits() == 255 ? drawn : merge(lanes, drawn, result);
    rest = and_not(rest, lanes);
  }
  result.weight = result.weight * (F8(1.0f) / chosen.pmf);
  result.pdf_solid_angle = result.pdf_solid_angle * chosen.pmf_at_point;
  result.valid = result.valid & (chosen.pmf > F8(0.0f));
  result.light = chosen.light;
  return result;
}

std::uint64_t LightTable::bytes() const {
  // Rows have the size of their structs, except flags, which are wider. Facets also have normals and densities.
  const auto rows = [](const auto& lights, std::size_t bytes) { return std::uint64_t{lights.size()} * bytes; };
  return rows(facets, sizeof(EmissiveFacet) + sizeof(Vec3) + sizeof(float)) + rows(spheres, sizeof(EmissiveSphere)) +
         rows(disks, sizeof(DiskEmitter) + sizeof(Vec3) + sizeof(float)) + rows(points, sizeof(PointEmitter)) +
         rows(spots, sizeof(SpotEmitter)) + rows(cosine_powers, sizeof(CosinePowerEmitter)) +
         rows(directional, sizeof(DirectionalEmitter)) + ies.bytes() + environment.bytes() + choice_.bytes() +
         4 * group_.size();
}

LightSample8 LightTable::sample_point(std::uint32_t light, const V8& p, M8 lanes) const {
  const LightKind kind = kind_of(light);
  const U8 index(light - first(kind));
  switch (kind) {
    case LightKind::disk:
      return disks.sample(p, index, lanes);
    case LightKind::point:
      return points.sample(p, index, lanes);
    case LightKind::spot:
      return spots.sample(p, index, lanes);
    case LightKind::cosine_power:
      return cosine_powers.sample(p, index, lanes);
    case LightKind::ies:
      return ies.sample(p, index, lanes);
    case LightKind::directional:
      return directional.sample(p, index, lanes);
    case LightKind::facet:
    case LightKind::sphere:
    case LightKind::environment:
      break;
  }
  LM_CHECK(false, "no point");
}

F8 LightTable::pdf_solid_angle(const V8& from, U8 light, F8 distance, F8 cos_light, M8 lanes) const {
  const U8 first_sphere(first(LightKind::sphere));
  const M8 facet = lanes & signed_less(light, first_sphere);
  const M8 sphere = and_not(lanes & signed_less(light, U8(first(LightKind::disk))), facet);
  F8 pdf(0.0f);
  if (facet.any()) {
    pdf = facets.pdf_solid_angle(from, light, distance, cos_light, facet);
  }
  if (sphere.any()) {
    pdf = select(sphere, spheres.pdf_solid_angle(from, light - first_sphere, distance, cos_light, sphere), pdf);
  }
  if (disks.size() > 0) {
    const U8 index = light - U8(first(LightKind::disk));
    const M8 some = and_not(and_not(lanes & signed_less(light, U8(first(LightKind::point))), facet), sphere);
    pdf = select(some, disks.pdf_solid_angle(index, distance, cos_light, some), pdf);
  }
  for_each_spherical_kind(light, lanes, [&](const auto& spheres, U8 index, M8 some) {
    const F8 of_spheres =
        spherical_light_pdf_solid_angle(from, spheres.position(index, some), spheres.radii().at(index, some));
    pdf = select(some, of_spheres, pdf);
  });
  return needs_choice() ? pdf * choice_.pmf(from, light, lanes) : pdf;
}

F8 LightTable::distant_pdf_solid_angle(const V8& from, U8 light, const V8& direction, M8 lanes) const {
  const U8 sky(first(LightKind::environment));
  const M8 suns = lanes & signed_less(light, sky), skies = and_not(lanes, suns);
  F8 pdf(0.0f);
  if (environment.samplable() && skies.any()) {
    pdf = environment.pdf_solid_angle(direction);
  }
  if (suns.any()) {
    const U8 index = light - U8(first(LightKind::directional));
    pdf = select(suns, directional.pdf_solid_angle(direction, index, suns), pdf);
  }
  return needs_choice() && (pdf > F8(0.0f)).any() ? pdf * choice_.pmf(from, light, lanes) : pdf;
}

LightTable::LightHit8 LightTable::meet(std::uint32_t light_index, const V8& origin, const V8& direction,
                                       M8 lanes) const {
  if (light_index < first(LightKind::point)) {
    const U8 index(light_index - first(LightKind::disk));
    const DiskLights::Entry8 entry = disks.meet(origin, direction, index, lanes);
    return {entry.hit, origin + direction * entry.distance, disks.radiance(index, entry.cosine, lanes), entry.distance,
            entry.cosine};
  }
  LightHit8 out{};
  for_each_spherical_kind(U8(light_index), lanes, [&](const auto& spheres, U8 index, M8 some) {
    const F8 radius = spheres.radii().at(index, some);
    const SphereEntry8 entry(origin, direction, spheres.position(index, some), radius, some);
    out = {entry.hit, origin + direction * entry.distance,
           spheres.intensity(-direction, index, some) * (F8(kInvPi) / (radius * radius)), entry.distance, entry.cosine};
  });
  if (light_index < first(LightKind::directional)) {
    return out;
  }
  const U8 index(light_index - first(LightKind::directional));
  const M8 hit = lanes & (directional.pdf_solid_angle(direction, index, lanes) > F8(0.0f));
  return {hit, origin + direction * F8(kFarAway), directional.radiance(index, lanes), F8(kFarAway), F8(1.0f)};
}

F8 LightTable::hit_pdf_solid_angle(std::uint32_t light_index, const V8& from, const V8& direction, const LightHit8& met,
                                   M8 lanes) const {
  if (light_index < first(LightKind::directional)) {
    return pdf_solid_angle(from, U8(light_index), met.distance, met.cosine, lanes);
  }
  return distant_pdf_solid_angle(from, U8(light_index), direction, lanes);
}

}  // namespace lightmill
