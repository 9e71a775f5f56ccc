// Connections of camera paths with light paths.
#include "common/methods/path/connecting.h"
#include "common/methods/path/gathering.h"
#include "common/methods/photons/seen_splats.h"
#include "common/methods/surface_bsdf.h"

namespace lightmill::path {

/// Of a camera path that has come to a light that next-event estimation knows. What is seen directly, nothing else
/// finds.
F8 Batch::found_light_weight(const Path8& in, U8 light, const V8& point, F8 cosine, std::uint32_t bounce,
                             M8 lanes) const {
  if (bounce == 0) {
    return F8(1.0f);
  }
  return vcm::found_light(in.partial, vcm::light_densities(scene_, *light_pass_->emission, light, in.origin, point,
                                                           -in.direction, cosine, lanes));
}

/// Light that deposits have brought to a camera path's vertex (or to what is seen directly: bounce 0) and that it
/// sends on.
void Batch::add_brought(M8 lanes, U8 slot, const photons::Deposit8& deposits, const V8& value, std::uint32_t bounce) {
  const M8 direct = lanes & (deposits.scatterings == U8(1u)) & M8(bounce == 0);
  add_light(direct, slot, value, true);
  add_light(and_not(lanes, direct), slot, value, false);
  if (channels_.separates_lights()) {
    add_to_group(lanes, slot, deposits.group, value);
  }
}

/// What of the light paths' vertices is seen from those of the camera paths, and goes on to the eye. A deposit's power
/// is what it brings to a place, so what it sends on is radiance per area: Georgiev et al. 2012, eq. 5.
///
/// A path's connections come after what is merged at its vertex and before what its shadow ray brings, whenever the
/// queue is emptied: so in how large pieces that is done changes no bit.
void Batch::trace_connections() {
  const photons::LightPass& pass = *light_pass_;
  const auto light_paths = static_cast<float>(pass.photons);
  for (int i = 0; i < ws_.connections.size(); i += 8) {
    const M8 lanes = first_lanes(ws_.connections.size() - i);
    const Connection8 c = ws_.connections.load(i);
    const photons::Deposit8 d = photons::load_deposits(pass.deposits, c.deposit, lanes);
    const V8 way = d.point - c.origin;
    const F8 distance = sqrt(length_squared(way));
    const V8 direction = way * (F8(1.0f) / distance);
    const Ray8 rays{c.origin, direction, F8(std::numeric_limits<float>::infinity())};
    const Arrival8 arrival = lightmill::travel(scene_, lanes, rays, c.media, kNoGeometry, ws_.counters);
    const Surface8 surface = scene_.surface(arrival.rays, arrival.hits);
    const F8 cosine = abs(dot(direction, surface.geometric_normal));
    const M8 seen = lanes & photons::found_again(arrival, surface, d, distance, cosine);
    if (seen.none()) {
      continue;
    }
    const V8 facing = select(surface.front, surface.geometric_normal, -surface.geometric_normal);
    const Frame8 frame(select(surface.front, surface.shading_normal, -surface.shading_normal));
    const V8 wo = frame.to_local(-direction), wi = frame.to_local(d.wi);
    const F8 per_area = cosine / (distance * distance) * F8(light_paths);  // powers are shares of all paths
    const V8 value = c.value * arrival.transmittance * d.power * per_area;
    const F8 merging = pass.merging_factor(surface.point);
    for_each_kind(scene_.materials(), surface, seen, [&](MaterialKind kind, M8 of_kind) {
      visit_bsdf(scene_, kind, surface, arrival.crossing, wo, of_kind, [&](const auto& bsdf, M8 there) {
        if constexpr (requires { bsdf.eval(wo, wo); }) {
          const F8 behind = vcm::behind(pass.partials(c.deposit, there), merging, bsdf.pdf_solid_angle(wo, wi));
          const F8 light_pdf = vcm::pdf_back(scene_, surface, arrival.crossing, bsdf, wo, wi, there);
          const F8 weight = vcm::connected(c.behind, c.pdf, c.cosine, behind, light_pdf, cosine, distance * distance);
          const V8 sent = sent_on(bsdf, wo, frame, facing, d.wi);
          const V8 brought = masked(max_component(sent) > F8(0.0f), value * sent * weight);
          add_light(there, c.slot, brought, false);
          if (channels_.separates_lights()) {
            add_to_group(there, c.slot, d.group, brought);
          }
        }
      });
    });
  }
  ws_.connections.clear();
}

}  // namespace lightmill::path
