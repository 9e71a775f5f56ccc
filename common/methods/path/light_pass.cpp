// What the light side brings: photons that are seen directly, and those that cross meters.
#include "common/methods/path/gathering.h"
#include "common/methods/photons/seen_splats.h"
#include "common/methods/surface_bsdf.h"

namespace lightmill::path {
void Batch::add_light_pass() {
  if (meter_ != nullptr) {
    add_meter_hits();
  } else {
    add_splats();
  }
}

/// Light that goes over casters first is scattered twice at least.
void Batch::add_caustic(M8 lanes, U8 slot, U8 group, const V8& value) {
  add_light(lanes, slot, value, false);
  if (channels_.caustic >= 0) {
    add_to_plane(channels_.caustic, lanes, slot, value);
  }
  if (channels_.separates_lights()) {
    add_to_group(lanes, slot, group, value);
  }
}

void Batch::add_splats() {
  photons::for_each_seen(scene_, *light_pass_, tile_, ws_.splats, ws_.counters, [&](const photons::SeenSplat8& splat) {
    const Surface8& surface = splat.surface;
    const V8 facing = select(surface.front, surface.geometric_normal, -surface.geometric_normal);
    const Frame8 frame(select(surface.front, surface.shading_normal, -surface.shading_normal));
    const V8 wo = frame.to_local(-splat.direction);
    const V8 power = splat.deposit.power * splat.arrival.transmittance * splat.per_power;
    for_each_kind(scene_.materials(), surface, splat.lanes, [&](MaterialKind kind, M8 of_kind) {
      visit_bsdf(scene_, kind, surface, splat.arrival.crossing, wo, of_kind, [&](const auto& bsdf, M8 lanes) {
        if constexpr (requires { bsdf.eval(wo, wo); }) {
          V8 value = power * sent_on(bsdf, wo, frame, facing, splat.deposit.wi);
          if (connects()) {
            const F8 back = bsdf.pdf_solid_angle(wo, frame.to_local(splat.deposit.wi));
            const F8 light = vcm::behind(light_pass_->partials(splat.number, lanes),
                                         light_pass_->merging_factor(surface.point), back);
            const F8 weight = vcm::splatted(light, splat.film_pdf_area, static_cast<float>(light_pass_->photons));
            value = masked(max_component(value) > F8(0.0f), value * weight);
            add_brought(lanes, splat.pixel, splat.deposit, value, 0);
          } else {
            add_caustic(lanes, splat.pixel, splat.deposit.group, value);
          }
        }
      });
    });
  });
}

void Batch::add_meter_hits() {
  for (const photons::MeterHit& hit : light_pass_->meters[meter_of(tile_)]) {
    // A part of a meter's tile is a rectangle of its pixels.
    const int x = static_cast<int>(hit.pixel) % kTileSize - tile_.x;
    const int y = static_cast<int>(hit.pixel) / kTileSize - (tile_.y - meter_rect(meter_of(tile_)).y);
    if (x >= 0 && x < tile_.width && y >= 0 && y < tile_.height) {
      add_caustic(first_lanes(1), U8(static_cast<std::uint32_t>(y * tile_.width + x)), U8(hit.group),
                  broadcast(hit.value));
    }
  }
}

}  // namespace lightmill::path
