#include "common/lights/light_emission.h"

#include "common/base/check.h"

namespace lightmill {

namespace {

template <class Spheres>
EmissionPoint8 sphere_point(const Spheres& spheres, U8 index, M8 lanes, const V8& outward) {
  return sphere_emission_point(spheres.position(index, lanes), spheres.radii().at(index, lanes), lanes, outward);
}

}  // namespace

template <class Take>
void LightEmission::for_each_kind(U8 light, M8 lanes, Take take) const {
  for (int k = 0; k < kLightKinds && lanes.any(); ++k) {
    const auto kind = static_cast<LightKind>(k);
    // The environment is last, also if the table does not count it.
    const M8 of_kind =
        k + 1 < kLightKinds ? lanes & signed_less(light, U8(table_->first(static_cast<LightKind>(k + 1)))) : lanes;
    if (of_kind.any()) {
      take(kind, light - U8(table_->first(kind)), of_kind);
      lanes = and_not(lanes, of_kind);
    }
  }
}

EmissionPoint8 LightEmission::point_on(U8 light, M8 lanes, Pair8 u) const {
  EmissionPoint8 out{};
  for_each_kind(light, lanes, [&](LightKind kind, U8 index, M8 of_kind) {
    EmissionPoint8 here{};
    switch (kind) {
      case LightKind::facet:
        here = table_->facets.emission_point(index, of_kind, u);
        break;
      case LightKind::sphere:
        here = table_->spheres.emission_point(index, of_kind, square_to_sphere(u));
        break;
      case LightKind::disk:
        here = table_->disks.emission_point(index, of_kind, u);
        break;
      case LightKind::point:
        here = sphere_point(table_->points, index, of_kind, square_to_sphere(u));
        break;
      case LightKind::spot:
        here = sphere_point(table_->spots, index, of_kind, square_to_sphere(u));
        break;
      case LightKind::cosine_power:
        here.point = table_->cosine_powers.position(index, of_kind);
        break;
      case LightKind::ies:
        here.point = table_->ies.position(index, of_kind);
        break;
      case LightKind::directional:
      case LightKind::environment:
        LM_CHECK(false, "infinitely far");
    }
    out = merge(of_kind, here, out);
  });
  return out;
}

LightEmission::LightSpheres8 LightEmission::spheres(U8 light, M8 lanes) const {
  LightSpheres8 out{};
  const auto add = [&](M8 some, const V8& center, F8 radius) {
    out = {out.lanes | some, select(some, center, out.center), select(some, radius, out.radius)};
  };
  for_each_kind(light, lanes, [&](LightKind kind, U8 index, M8 of_kind) {
    if (kind == LightKind::sphere) {
      const SphereLights& spheres = table_->spheres;
      add(spheres.outward_only(index, of_kind), spheres.center(index, of_kind), spheres.radius(index, of_kind));
    }
  });
  table_->for_each_spherical_kind(light, lanes, [&](const auto& of_kind, U8 index, M8 some) {
    const F8 radius = of_kind.radii().at(index, some);
    add(some & (radius > F8(0.0f)), of_kind.position(index, some), radius);
  });
  return out;
}

EmissionPoint8 LightEmission::point_on_sphere(U8 light, M8 spheres, const V8& outward) const {
  EmissionPoint8 out{};
  for_each_kind(light, spheres, [&](LightKind kind, U8 index, M8 of_kind) {
    if (kind == LightKind::sphere) {
      out = merge(of_kind, table_->spheres.emission_point(index, of_kind, outward), out);
    }
  });
  table_->for_each_spherical_kind(light, spheres, [&](const auto& of_kind, U8 index, M8 some) {
    out = merge(some, sphere_point(of_kind, index, some, outward), out);
  });
  return out;
}

V8 LightEmission::intensity(U8 light, const EmissionPoint8& from, const V8& direction, M8 lanes) const {
  const F8 cos_signed = dot(direction, from.normal);
  const F8 cosine = max(select(from.two_sided, abs(cos_signed), cos_signed), F8(0.0f));
  // Radiance I/(π r²), times the cosine and the area 4π r².
  const F8 of_sphere = select(from.surface, F8(4.0f) * cosine, F8(1.0f));
  V8 out{};
  for_each_kind(light, lanes, [&](LightKind kind, U8 index, M8 of_kind) {
    V8 here{};
    switch (kind) {
      case LightKind::facet:
        here = table_->facets.radiance(index, cosine, of_kind) * from.texture * (cosine * from.area);
        break;
      case LightKind::sphere:
        here = table_->spheres.radiance(index, cosine, of_kind) * (cosine * from.area);
        break;
      case LightKind::disk:
        here = table_->disks.radiance(index, cosine, of_kind) * (cosine * from.area);
        break;
      case LightKind::point:
        here = table_->points.intensity(index, of_kind) * of_sphere;
        break;
      case LightKind::spot:
        here = table_->spots.intensity(direction, index, of_kind) * of_sphere;
        break;
      case LightKind::cosine_power:
        here = table_->cosine_powers.intensity(direction, index, of_kind);
        break;
      case LightKind::ies:
        here = table_->ies.intensity(direction, index, of_kind);
        break;
      case LightKind::directional:
      case LightKind::environment:
        LM_CHECK(false, "infinitely far");
    }
    out = select(of_kind, here, out);
  });
  return out;
}

F8 LightEmission::cosine(U8 light, const V8& point, const V8& direction, M8 lanes) const {
  F8 out(1.0f);
  for_each_kind(light, lanes, [&](LightKind kind, U8 index, M8 of_kind) {
    if (kind == LightKind::facet) {
      out = select(of_kind, abs(dot(direction, table_->facets.emission_point(index, of_kind, {}).normal)), out);
    } else if (kind == LightKind::disk) {
      out = select(of_kind, abs(dot(direction, table_->disks.normal(index, of_kind))), out);
    } else if (kind == LightKind::sphere) {
      const V8 outward = normalize(point - table_->spheres.center(index, of_kind));
      out = select(of_kind, abs(dot(direction, outward)), out);
    }
  });
  table_->for_each_spherical_kind(light, lanes, [&](const auto& of_kind, U8 index, M8 some) {
    const V8 outward = normalize(point - of_kind.position(index, some));
    out = select(table_->are_intersectable(light, some), abs(dot(direction, outward)), out);
  });
  return out;
}

F8 LightEmission::parallel_pdf(U8 light, M8 lanes, const V8& direction) const {
  const M8 sky = and_not(lanes, signed_less(light, U8(table_->first(LightKind::environment))));
  F8 out(1.0f);
  if (sky.any()) {
    out = select(sky, table_->environment.all_pdf_solid_angle(-direction), out);
  }
  if (const M8 disks = and_not(table_->are_intersectable(light, and_not(lanes, sky)), sky); disks.any()) {
    const U8 index = light - U8(table_->first(LightKind::directional));
    out = select(disks, table_->directional.pdf_solid_angle(-direction, index, disks), out);
  }
  return out;
}

LightEmission::Parallel8 LightEmission::parallel(U8 light, M8 lanes, Pair8 u) const {
  Parallel8 out{};
  for_each_kind(light, lanes, [&](LightKind kind, U8 index, M8 of_kind) {
    Parallel8 here;
    if (kind == LightKind::directional) {
      const LightSample8 sun = table_->directional.sample(broadcast(Vec3(0)), index, of_kind, u);
      here = {-sun.wi, sun.weight};
    } else {
      const EnvironmentRadiance::Beam8 beam = table_->environment.sample_all(u);
      here = {-beam.wi, beam.weight};
    }
    out = {select(of_kind, here.direction, out.direction), select(of_kind, here.irradiance, out.irradiance)};
  });
  return out;
}

}  // namespace lightmill
