// How the estimates of a virtual meter's tile begin.
#include "common/materials/diffuse.h"
#include "common/methods/path/scattering.h"

namespace lightmill::path {

/// A radiance meter's paths begin with its ray. One that receives light is a white Lambertian surface that no ray
/// meets: what it would send out is L = ρE/π with ρ = 1, so E is π times that, and lights are sampled from it as from
/// any surface. Gives the bounce with which the paths go on.
std::uint32_t Batch::start_meter(std::size_t first_pixel, std::size_t last_pixel,
                                 const std::vector<std::uint32_t>& seeds) {
  ws_.paths.clear();
  ws_.next.clear();
  ws_.shadows.clear();
  const V8 direction = broadcast(meter_->direction);
  for (std::size_t pixel = first_pixel; pixel < last_pixel; pixel += 8) {
    const M8 lanes = first_lanes(static_cast<int>(last_pixel - pixel));
    const U8 pixels = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
    const U8 seed = U8::load(&seeds[pixel]);
    Path8 path{};
    path.throughput = broadcast(Vec3(1));
    path.pdf_solid_angle = F8(0.0f);
    path.roulette_scale = F8(1.0f);
    path.slot = pixels;
    path.pixel_seed = seed;
    path.index = U8(plan_.index);
    path.media = meter_->media;
    if (meter_->looks) {
      path.origin = broadcast(meter_->corner);
      path.direction = direction;
      ws_.paths.push(lanes, path);
      continue;
    }
    const Pair8 u = sobol_pair(U8(plan_.index), decision_seed(seed, kFilterDecision));
    path.direction = -direction;
    path.throughput = path.throughput * F8(kPi);
    path.roulette_scale = F8(kInvPi);
    Surface8 surface{};
    surface.point = broadcast(meter_->corner) + broadcast(meter_->edge1) * u.u + broadcast(meter_->edge2) * u.v;
    surface.geometric_normal = surface.shading_normal = direction;
    surface.front = lanes;
    surface.offset = surface_offset(direction, broadcast(meter_->magnitude));
    path.chain = U8(kFromReceiver);
    Vertex8 vertex{path, surface, direction, Frame8(direction), 0};
    if (connects()) {
      vertex.merging =
          F8(light_pass_->meter_area(*meter_) * static_cast<float>(light_pass_->photons) / (kTileSize * kTileSize));
    }
    shade_scattering(vertex, Diffuse8{broadcast(Vec3(1))}, vertex.frame.to_local(direction), lanes);
  }
  if (meter_->looks) {
    return 0;
  }
  if (connects()) {
    trace_connections();
  }
  trace_shadows(0);
  std::swap(ws_.paths, ws_.next);
  return 1;
}

}  // namespace lightmill::path
