#include "common/methods/path/batch.h"

#include "common/methods/surface_bsdf.h"

namespace lightmill::path {

void Batch::run(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds) {
  std::uint32_t bounce = 0;
  if (photons_bring_all() && meter_ != nullptr && !meter_->looks) {
    return;
  }
  if (meter_ != nullptr) {
    bounce = start_meter(first_pixel, last_pixel, seeds);
  } else {
    start(first_pixel, last_pixel, seeds);
  }
  for (; ws_.paths.size() > 0 && !ws_.stop.stop_requested(); ++bounce) {
    ws_.next.clear();
    ws_.shadows.clear();
    for (int i = 0; i < ws_.paths.size(); i += 8) {
      shade(ws_.paths.load(i), first_lanes(ws_.paths.size() - i), bounce);
    }
    ws_.counters.closest_hit_rays += static_cast<std::uint64_t>(ws_.paths.size());
    if (connects()) {
      trace_connections();
    }
    trace_shadows(bounce);
    std::swap(ws_.paths, ws_.next);
  }
}

void Batch::start(std::size_t first_pixel, std::size_t last_pixel, const std::vector<std::uint32_t>& seeds) {
  ws_.paths.clear();
  for (std::size_t pixel = first_pixel; pixel < last_pixel; pixel += 8) {
    const M8 lanes = first_lanes(static_cast<int>(last_pixel - pixel));
    const U8 pixels = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
    const U8 seed = U8::load(&seeds[pixel]);
    const Ray8 rays = primary_rays(scene_, tile_, pixels, seed, plan_.index);
    Path8 path{rays.origin, rays.direction, broadcast(Vec3(1)), F8(0.0f),          F8(1.0f),
               pixels,      seed,           U8(plan_.index),    scene_.eye_media()};
    if (connects()) {
      const CameraBasis& camera = scene_.camera();
      const F8 cosine = dot(rays.direction, broadcast(camera.forward));
      const F8 pdf = F8(1.0f / glm::dot(camera.right, camera.right)) / (cosine * cosine * cosine);
      path.partial = vcm::camera_start(pdf, static_cast<float>(light_pass_->photons));
    }
    ws_.paths.push(lanes, path);
  }
}

/// Adds to three planes; `channel_of` gives the first for a lane.
template <class ChannelOf>
void Batch::add_to_planes(M8 lanes, U8 slot, const V8& value, const ChannelOf& channel_of) {
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

void Batch::add_to_plane(int channel, M8 lanes, U8 slot, const V8& value) {
  add_to_planes(lanes, slot, value, [channel](int) { return channel; });
}

/// Light that reaches the camera; `direct`: scattered at most once on its way.
void Batch::add_light(M8 lanes, U8 slot, const V8& value, bool direct) {
  add_to_plane(0, lanes, slot, value);
  if (const int layer = direct ? channels_.direct : channels_.indirect; layer >= 0) {
    add_to_plane(layer, lanes, slot, value);
  }
}

/// Adds to the planes of the layer that the lights of a group have.
void Batch::add_to_group(M8 lanes, U8 slot, U8 group, const V8& value) {
  alignas(32) std::uint32_t groups[8];
  group.store(groups);
  add_to_planes(lanes, slot, value, [&](int lane) { return channels_.light[groups[lane]]; });
}

/// Makes the samples of paths that are lost such as are not finite: they are counted, not lost in silence.
void Batch::add_not_finite(M8 lost, U8 slot) {
  add_to_plane(0, lost, slot, broadcast(Vec3(std::numeric_limits<float>::quiet_NaN())));
}

/// The same for those that arithmetic has led out of all numbers (only degenerate geometry does).
void Batch::add_untraceable(M8 lanes, const Ray8& rays, U8 slot) {
  const M8 lost = and_not(lanes, Accel::traceable(rays));
  if (lost.any()) [[unlikely]] {
    add_not_finite(lost, slot);
  }
}

void Batch::shade(const Path8& in, M8 lanes, std::uint32_t bounce) {
  const Ray8 rays{in.origin, in.direction, F8(std::numeric_limits<float>::infinity())};
  add_untraceable(lanes, rays, in.slot);
  Hit8 hits = scene_.accel().intersect(lanes, rays, bounce == 0);
  Passage8 passage;
  passage.origin = in.origin;
  if (scene_.features().media) {
    Path8 there = in;
    passage = pass_media(there, lanes, hits, bounce);
    if (passage.scattered.any()) {
      shade_medium(there, passage.point, passage.scattered & goes_on(in), bounce);
    }
    shade_hits(there, and_not(lanes, passage.scattered), hits, bounce, passage);
  } else {
    shade_hits(in, lanes, hits, bounce, passage);
  }
}

void Batch::shade_hits(const Path8& in, M8 lanes, const Hit8& hits, std::uint32_t bounce, const Passage8& passage) {
  if (scene_.features().environment) {
    add_environment(in, and_not(lanes, hits.hit), bounce);
  }
  if (hits.hit.none()) {
    return;
  }
  const Surface8 surface = scene_.surface({passage.origin, in.direction, F8(0.0f)}, hits);
  if (bounce == 0 && meter_ == nullptr && channels_.shows_surfaces()) {
    store_surfaces(channels_, scene_, hits, surface, in.slot,
                   {ws_.radiance.data(), slots_, ws_.first.empty() ? nullptr : ws_.first.data(), pixels_});
  }
  if (scene_.features().emissive_surfaces) {
    Hit8 from_start = hits;
    from_start.distance = hits.distance + passage.before;
    add_emission(in, from_start, surface, bounce);
  }
  if (bounce == max_bounces_) {
    return;
  }
  M8 shaded = hits.hit;
  if (scene_.features().holdouts) {
    shaded = shaded & goes_on(in);
    if (shaded.none()) {
      return;
    }
  }
  // The frame to shade in is on the ray's side of the surface.
  const M8 casters = light_pass_ != nullptr ? scene_.materials().casters(surface.material, shaded) : M8();
  Vertex8 vertex{in,
                 surface,
                 select(surface.front, surface.geometric_normal, -surface.geometric_normal),
                 Frame8(select(surface.front, surface.shading_normal, -surface.shading_normal)),
                 bounce,
                 passage.crossing,
                 casters};
  if (connects()) {
    const F8 cosine = max(abs(dot(in.direction, surface.geometric_normal)), F8(1e-8f));
    vertex.partial = vcm::arrive(in.partial, length_squared(surface.point - in.origin), cosine);
    vertex.merging = light_pass_->merging_factor(surface.point);
  }
  for_each_kind(scene_.materials(), surface, shaded,
                [&](MaterialKind kind, M8 of_kind) { shade_kind(kind, vertex, of_kind); });
}

/// A light and a point on it, by the decisions of this vertex.
LightSample8 Batch::draw_light(const V8& point, U8 index, U8 pixel_seed, std::uint32_t bounce) const {
  const LightTable& lights = scene_.lights();
  Pair8 choice{F8(0.0f), F8(0.0f)};
  if (lights.needs_choice()) {
    choice.u = decide(index, pixel_seed, bounce, choice_decision(bounce)).u;
  }
  if (lights.needs_second_choice()) {
    choice.v = hashed_number(index, decision_seed(pixel_seed, light_decision(bounce)));
  }
  return lights.sample(point, choice, decide(index, pixel_seed, bounce, light_decision(bounce)));
}

/// The slot of a shadow ray to a light, with the light's group where groups are told apart.
U8 Batch::shadow_slot(U8 slot, const LightSample8& light, M8 lanes) const {
  return channels_.separates_lights() ? slot + (scene_.lights().group(light.light, lanes) << kGroupShift) : slot;
}

/// Light that the path finds by itself, weighted against next-event estimation having found it.
void Batch::add_emission(const Path8& in, const Hit8& hits, const Surface8& surface, std::uint32_t bounce) {
  M8 emitting = scene_.materials().emits(surface, hits.hit);
  if (light_pass_ != nullptr && !connects()) {
    emitting = and_not(emitting, scene_.sampled_lights(hits, emitting) & (in.chain == U8(kOverCasters)));
  }
  if (emitting.none()) {
    return;
  }
  const F8 cos_light = abs(dot(in.direction, surface.geometric_normal));
  F8 weight;
  if (connects()) {
    const EmitterTable::Lights8 found = scene_.emitter(hits, emitting);
    weight = select(found.sampled, found_light_weight(in, found.light, surface.point, cos_light, bounce, found.sampled),
                    F8(1.0f));
  } else {
    const F8 light_pdf = scene_.light_pdf_solid_angle(in.origin, hits, cos_light, emitting);
    weight = select(in.pdf_solid_angle > F8(0.0f), mis_weight(in.pdf_solid_angle, light_pdf), F8(1.0f));
  }
  const V8 light = in.throughput * scene_.materials().emission(surface, cos_light, emitting) * weight;
  add_light(emitting, in.slot, light, bounce <= 1);
  if (channels_.separates_lights()) {
    add_to_group(emitting, in.slot, scene_.materials().light_group(surface, emitting), light);
  }
}

/// The same for the environment, which rays find where they hit nothing.
void Batch::add_environment(const Path8& in, M8 escaped, std::uint32_t bounce) {
  if (light_pass_ != nullptr && !connects() && scene_.lights().environment.samplable()) {
    escaped = and_not(escaped, in.chain == U8(kOverCasters));
  }
  if (escaped.none()) {
    return;
  }
  const LightTable& lights = scene_.lights();
  F8 weight;
  if (connects()) {
    weight = found_light_weight(in, U8(lights.first(LightKind::environment)), in.origin, F8(1.0f), bounce, escaped);
  } else {
    const F8 light_pdf = lights.environment_pdf_solid_angle(in.origin, in.direction, escaped);
    weight = select(in.pdf_solid_angle > F8(0.0f), mis_weight(in.pdf_solid_angle, light_pdf), F8(1.0f));
  }
  add_background(in, escaped, lights.environment.radiance(in.direction) * weight, bounce);
}

/// Radiance of the environment that a path has come to.
void Batch::add_background(const Path8& in, M8 lanes, const V8& radiance, std::uint32_t bounce) {
  const V8 light = in.throughput * radiance;
  add_light(lanes, in.slot, light, bounce <= 1);
  if (channels_.separates_lights()) {
    add_to_group(lanes, in.slot, U8(scene_.environment_group()), light);
  }
}

void Batch::trace_shadows(std::uint32_t bounce) {
  for (int i = 0; i < ws_.shadows.size(); i += 8) {
    const M8 lanes = first_lanes(ws_.shadows.size() - i);
    Shadow8 s = ws_.shadows.load(i);
    U8 group(0u);
    if (channels_.separates_lights()) {
      group = s.slot >> kGroupShift;
      s.slot = s.slot & U8((1u << kGroupShift) - 1);
    }
    const Ray8 rays{s.origin, s.direction, F8(1.0f)};
    add_untraceable(lanes, rays, s.slot);
    const M8 blocked = scene_.accel().occluded(lanes, rays);
    M8 lit = lanes;
    if (scene_.features().media) {
      s.contribution = s.contribution * light_through_media(s, lanes, blocked);
    } else {
      lit = and_not(lanes, blocked);
    }
    add_light(lit, s.slot, s.contribution, bounce == 0);
    if (channels_.separates_lights()) {
      add_to_group(lit, s.slot, group, s.contribution);
    }
  }
  ws_.counters.shadow_rays += static_cast<std::uint64_t>(ws_.shadows.size());
}

}  // namespace lightmill::path
