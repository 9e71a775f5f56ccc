#include "common/methods/tracer/wavefront.h"

#include "common/methods/camera_rays.h"
#include "common/methods/texture_footprint.h"

namespace lightmill::tracer {

Wavefront::Wavefront(const CompiledScene& scene, const FilmChannels& channels, const PixelRect& tile,
                     const SamplePlan& plan, std::uint32_t max_bounces, WavefrontWorkspace& ws)
    : scene_(scene),
      channels_(channels),
      tile_(tile),
      plan_(plan),
      meter_(is_meter_rect(tile) ? &scene.meters().at(meter_of(tile)) : nullptr),
      max_bounces_(max_bounces + (on_irradiance_meter() ? 1 : 0)),  // the meter's own surface does not count
      pixels_(static_cast<std::uint32_t>(tile.pixel_count())),
      slots_(pixels_ * plan.splits),
      ws_(ws) {
  ws_.radiance.assign(std::size_t{channels_.layout.summed} * slots_, 0.0f);
}

/// `channel_of` returns the first of three planes for a lane.
template <class ChannelOf>
void Wavefront::add_to_planes(M8 lanes, U8 slot, const V8& value, const ChannelOf& channel_of) {
  alignas(32) float r[8], g[8], b[8];
  alignas(32) std::uint32_t p[8];
  value.x.store(r);
  value.y.store(g);
  value.z.store(b);
  slot.store(p);
  for (unsigned bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
    const int lane = std::countr_zero(bits);
    float* const red = ws_.radiance.data() + static_cast<std::size_t>(channel_of(lane)) * slots_ + p[lane];
    red[0] += r[lane];
    red[slots_] += g[lane];
    red[2 * slots_] += b[lane];
  }
}

void Wavefront::add_to_layer(int channel, M8 lanes, U8 slot, const V8& value) {
  add_to_planes(lanes, slot, value, [channel](int) { return channel; });
}

void Wavefront::add_light(M8 lanes, U8 slot, const V8& value, bool direct, U8 group) {
  add_to_layer(0, lanes, slot, value);
  if (const int layer = direct ? channels_.direct : channels_.indirect; layer >= 0) {
    add_to_layer(layer, lanes, slot, value);
  }
  if (channels_.separates_lights()) {
    alignas(32) std::uint32_t groups[8];
    group.store(groups);
    add_to_planes(lanes, slot, value, [&](int lane) { return channels_.light[groups[lane]]; });
  }
}

void Wavefront::add_photons(M8 lanes, U8 slot, const V8& value, U8 group) {
  add_light(lanes, slot, value, false, group);
  if (channels_.caustic >= 0) {
    add_to_layer(channels_.caustic, lanes, slot, value);
  }
}

void Wavefront::add_background(const Path8& in, M8 lanes, const V8& radiance, std::uint32_t bounce) {
  add_light(lanes, in.slot, in.throughput * radiance, bounce <= 1, U8(scene_.environment_group()));
}

void Wavefront::add_not_finite(M8 lanes, U8 slot) {
  add_to_layer(0, lanes, slot, broadcast(Vec3(std::numeric_limits<float>::quiet_NaN())));
}

void Wavefront::add_untraceable(M8 lanes, const Ray8& rays, U8 slot) {
  const M8 lost = and_not(lanes, Accel::traceable(rays));
  if (lost.any()) [[unlikely]] {
    add_not_finite(lost, slot);
  }
}

Path8 Wavefront::camera_paths(std::size_t pixel, U8 seed) const {
  const U8 pixels = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
  const Ray8 rays = sample_camera_rays(scene_, tile_, pixels, seed, plan_.index);
  return {rays.origin, rays.direction,  broadcast(Vec3(1)),   F8(0.0f), F8(1.0f), pixels,
          seed,        U8(plan_.index), scene_.camera_media()};
}

/// A radiance meter's paths begin with its ray. An irradiance meter is a white Lambertian surface. It would reflect L =
/// ρE/π with ρ = 1, so its paths carry π.
Path8 Wavefront::meter_paths(std::size_t pixel, U8 seed) const {
  const U8 pixels = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
  const V8 direction = broadcast(meter_->direction);
  const bool measures_radiance = meter_->measures_radiance;
  return {broadcast(measures_radiance ? meter_->corner : Vec3(0)),
          measures_radiance ? direction : -direction,
          broadcast(Vec3(measures_radiance ? 1.0f : kPi)),
          F8(0.0f),
          F8(measures_radiance ? 1.0f : kInvPi),
          pixels,
          seed,
          U8(plan_.index),
          meter_->media};
}

/// Start points on an irradiance meter.
Surface8 Wavefront::meter_surface(const Path8& paths, M8 lanes) const {
  const V8 direction = broadcast(meter_->direction);
  const Pair8 u = sobol_pair(U8(plan_.index), decision_seed(paths.pixel_seed, kFilterDecision));
  Surface8 surface{};
  surface.point = broadcast(meter_->corner) + broadcast(meter_->edge1) * u.u + broadcast(meter_->edge2) * u.v;
  surface.geometric_normal = surface.shading_normal = direction;
  surface.front = lanes;
  surface.offset = surface_offset(direction, broadcast(meter_->magnitude));
  return surface;
}

/// Of camera rays, also behind delta BSDFs. These do not say how far they spread neighbours, so only the last segment
/// counts there, as wide as a pixel.
F8 Wavefront::footprint(const Path8& in, const Hit8& hits, const Surface8& surface, F8 before,
                        std::uint32_t bounce) const {
  if (meter_ != nullptr) {
    return F8(0.0f);
  }
  const F8 distance = before + hits.distance;
  const F8 width = bounce == 0 ? camera_width(scene_, in.direction, distance)
                               : F8(kPixelFootprint * scene_.camera().pixel) * distance;
  const F8 found = texture_footprint(scene_, hits, surface, in.direction, width);
  return masked(in.pdf_solid_angle == F8(0.0f), found);
}

LightSample8 Wavefront::draw_light(const V8& point, const V8& normal, const Path8& path, std::uint32_t bounce,
                                   std::uint32_t draw) const {
  const LightTable& lights = scene_.lights();
  const Pair8 u = decide(path, bounce, light_decision(bounce, draw));
  if (!lights.needs_choice()) {
    return lights.sample_light(draw, point, u);
  }
  Pair8 choice{decide(path, bounce, choice_decision(bounce)).u, F8(0.0f)};
  if (lights.needs_second_choice()) {
    choice.v = hashed_number(path.index, decision_seed(path.pixel_seed, light_decision(bounce)));
  }
  return lights.sample(point, draw, choice, u, normal);
}

void Wavefront::push_shadows(M8 lanes, const V8& origin, const LightSample8& light, const V8& contribution, U8 slot,
                             const Media8& media) {
  const U8 slot_and_group =
      channels_.separates_lights() ? slot + (scene_.lights().group(light.light, lanes) << kGroupShift) : slot;
  ws_.shadows.push(lanes, {origin, light.point - origin, contribution, slot_and_group, media});
}

void Wavefront::trace_shadows(std::uint32_t bounce) {
  constexpr std::uint32_t kSlotBits = (1u << kGroupShift) - 1;
  for (int i = 0; i < ws_.shadows.size(); i += 8) {
    const M8 lanes = first_lanes(ws_.shadows.size() - i);
    Shadow8 s = ws_.shadows.load(i);
    const U8 group = s.slot >> kGroupShift;
    s.slot = s.slot & U8(kSlotBits);
    const Ray8 rays{s.origin, s.direction, F8(1.0f)};
    add_untraceable(lanes, rays, s.slot);
    const M8 blocked = scene_.accel().occluded(lanes, rays);
    M8 lit = lanes;
    if (scene_.features().media) {
      s.contribution = s.contribution * shadow_transmittance(s, lanes, blocked);
    } else if (scene_.features().opacity) {
      const F8 share = share_passed(scene_, blocked, rays, ws_.counters);
      lit = and_not(lanes, blocked & (share == F8(0.0f)));
      s.contribution = select(blocked, s.contribution * share, s.contribution);
    } else {
      lit = and_not(lanes, blocked);
    }
    add_light(lit, s.slot, s.contribution, bounce == 0, group);
  }
  ws_.counters.shadow_rays += static_cast<std::uint64_t>(ws_.shadows.size());
}

void Wavefront::add_unoccluded(const Path8& in, M8 lanes, std::uint32_t light_index, const V8& point, const V8& light,
                               std::uint32_t bounce) {
  const Shadow8 way{in.origin, point - in.origin, light, in.slot, in.media};
  const Ray8 rays{way.origin, way.direction, F8(1.0f)};
  const M8 blocked = scene_.accel().occluded(lanes, rays);
  ws_.counters.shadow_rays += static_cast<std::uint64_t>(lanes.count());
  const U8 group = channels_.separates_lights() ? scene_.lights().group(U8(light_index), lanes) : U8(0u);
  if (scene_.features().media) {
    add_light(lanes, in.slot, light * shadow_transmittance(way, lanes, blocked), bounce <= 1, group);
  } else if (scene_.features().opacity) {
    const F8 share = select(blocked, share_passed(scene_, blocked, rays, ws_.counters), F8(1.0f));
    add_light(and_not(lanes, share == F8(0.0f)), in.slot, light * share, bounce <= 1, group);
  } else {
    add_light(and_not(lanes, blocked), in.slot, light, bounce <= 1, group);
  }
}

M8 Wavefront::roulette(Path8& paths, M8 lanes, std::uint32_t bounce) const {
  if (bounce < plan_.first_roulette) {
    return lanes;
  }
  const F8 survival = max_component(paths.throughput) * paths.roulette_scale * F8(plan_.roulette_boost);
  return tracer::roulette(lanes, survival, paths.index, paths.pixel_seed, bounce, paths.throughput);
}

void Wavefront::sum_splits() {
  const std::size_t pixels = pixels_;
  for (std::size_t channel = 0; plan_.splits > 1 && channel < channels_.layout.summed; ++channel) {
    const float* const from = ws_.radiance.data() + channel * slots_;
    // The output overlaps the input. It never lies behind the values that are still to be read.
    float* const to = ws_.radiance.data() + channel * pixels;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      float sum = from[pixel];
      for (std::size_t split = 1; split < plan_.splits; ++split) {
        sum += from[split * pixels + pixel];
      }
      to[pixel] = sum;
    }
  }
}

}  // namespace lightmill::tracer
