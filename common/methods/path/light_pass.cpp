// What the light side brings: photons that are seen directly, and those that cross meters.
#include "common/methods/path/gathering.h"
#include "common/methods/surface_bsdf.h"
#include "common/methods/travel.h"

namespace lightmill::path {
namespace {

/// Eight splats of one tile.
struct Splat8 {
  M8 lanes;
  U8 deposit, slot;
  F8 weight;
  V8 eye;
};

Splat8 load_splats(std::span<const photons::Splat* const> splats, const PixelRect& tile) {
  alignas(32) std::uint32_t deposit[8] = {}, slot[8] = {};
  alignas(32) float weight[8] = {}, x[8] = {}, y[8] = {}, z[8] = {};
  const std::size_t count = std::min<std::size_t>(splats.size(), 8);
  for (std::size_t i = 0; i < count; ++i) {
    const photons::Splat& splat = *splats[i];
    deposit[i] = splat.deposit;
    slot[i] = static_cast<std::uint32_t>((splat.y - tile.y) * tile.width + splat.x - tile.x);
    weight[i] = splat.weight;
    x[i] = splat.eye.x;
    y[i] = splat.eye.y;
    z[i] = splat.eye.z;
  }
  return {first_lanes(static_cast<int>(count)),
          U8::load(deposit),
          U8::load(slot),
          F8::load(weight),
          {F8::load(x), F8::load(y), F8::load(z)}};
}

/// Whether the ray has found the deposit itself. On a sphere, which is one primitive, the two points that a ray meets
/// are told apart by more than rounding puts between a deposit and where it is found again.
M8 found_again(const Arrival8& arrival, const Surface8& surface, const photons::Deposit8& d, F8 distance, F8 cosine) {
  const V8 off = surface.point - d.point;
  const F8 tolerance = (surface.offset * F8(256.0f) + distance * F8(0x1p-16f)) / max(cosine, F8(1e-3f));
  return arrival.hits.hit & (arrival.hits.geometry == d.geometry) & (arrival.hits.primitive == d.primitive) &
         (length_squared(off) < tolerance * tolerance);
}

}  // namespace

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

/// A pixel's value is the integral over the film of the filter times radiance; a place of the film, in pixels, is
/// cos³θ/D² of solid angle, D the film's distance in pixels, and a deposit's solid angle is |cos|/d² of its area
/// (Pharr, Jakob and Humphreys 2016, "Physically Based Rendering", 16.1.1).
void Batch::add_splats() {
  ws_.splats.clear();
  light_pass_->splats.find(tile_, ws_.splats);
  const CameraBasis& camera = scene_.camera();
  const F8 film_distance2(1.0f / glm::dot(camera.right, camera.right));
  for (std::size_t i = 0; i < ws_.splats.size(); i += 8) {
    const Splat8 splat = load_splats(std::span(ws_.splats).subspan(i), tile_);
    const photons::Deposit8 d = photons::load_deposits(light_pass_->deposits, splat.deposit, splat.lanes);
    const V8 way = d.point - splat.eye;
    const F8 distance = sqrt(length_squared(way));
    const V8 direction = way * (F8(1.0f) / distance);
    const Ray8 rays{splat.eye, direction, F8(std::numeric_limits<float>::infinity())};
    const Arrival8 arrival =
        lightmill::travel(scene_, splat.lanes, rays, scene_.eye_media(), kNoGeometry, ws_.counters);
    const Surface8 surface = scene_.surface(arrival.rays, arrival.hits);
    const F8 cosine = abs(dot(direction, surface.geometric_normal));
    const M8 seen = splat.lanes & found_again(arrival, surface, d, distance, cosine);
    if (seen.none()) {
      continue;
    }
    const V8 facing = select(surface.front, surface.geometric_normal, -surface.geometric_normal);
    const Frame8 frame(select(surface.front, surface.shading_normal, -surface.shading_normal));
    const V8 wo = frame.to_local(-direction);
    const F8 cos_film = dot(direction, broadcast(camera.forward));
    const F8 per_power =
        splat.weight * cosine * film_distance2 / (distance * distance * cos_film * cos_film * cos_film);
    const V8 power = d.power * arrival.transmittance * per_power;
    for_each_kind(scene_.materials(), surface, seen, [&](MaterialKind kind, M8 of_kind) {
      visit_bsdf(scene_, kind, surface, arrival.crossing, wo, of_kind, [&](const auto& bsdf, M8 lanes) {
        if constexpr (requires { bsdf.eval(wo, wo); }) {
          add_caustic(lanes, splat.slot, d.group, power * sent_on(bsdf, wo, frame, facing, d.wi));
        }
      });
    });
  }
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
