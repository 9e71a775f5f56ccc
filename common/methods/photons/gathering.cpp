#include "common/methods/photons/gathering.h"

namespace lightmill::photons {

namespace {

/// Up to eight splats of a tile, and the rays from the lens to them.
struct Splats8 {
  M8 lanes;
  U8 number, pixel;
  F8 weight;
  V8 lens_point;
  V8 direction;  ///< unit
  F8 distance;
  F8 film_distance2;  ///< square of the film's distance, in pixels
  F8 apart;           ///< film_distance2 / apart is the solid angle of a unit area across the ray, over a pixel's
  Photon8 photon;
};

Splats8 load_splats(const CompiledScene& scene, std::span<const Photon> photons, std::span<const Splat* const> splats,
                    const PixelRect& tile) {
  alignas(32) std::uint32_t number[8] = {}, pixel[8] = {};
  alignas(32) float weight[8] = {}, x[8] = {}, y[8] = {}, z[8] = {};
  const std::size_t count = std::min<std::size_t>(splats.size(), 8);
  for (std::size_t k = 0; k < count; ++k) {
    const Splat& splat = *splats[k];
    number[k] = splat.photon;
    pixel[k] = static_cast<std::uint32_t>((splat.y - tile.y) * tile.width + splat.x - tile.x);
    weight[k] = splat.weight;
    x[k] = splat.lens_point.x;
    y[k] = splat.lens_point.y;
    z[k] = splat.lens_point.z;
  }
  Splats8 out;
  out.lanes = first_lanes(static_cast<int>(count));
  out.number = U8::load(number);
  out.pixel = U8::load(pixel);
  out.weight = F8::load(weight);
  out.lens_point = {F8::load(x), F8::load(y), F8::load(z)};
  out.photon = load_photons(photons, out.number, out.lanes);
  const V8 way = out.photon.point - out.lens_point;
  out.distance = sqrt(length_squared(way));
  out.direction = way * (F8(1.0f) / out.distance);
  const CameraBasis& camera = scene.camera();
  out.film_distance2 = F8(1.0f / glm::dot(camera.right, camera.right));
  const F8 cos_film = dot(out.direction, broadcast(camera.forward));
  out.apart = out.distance * out.distance * cos_film * cos_film * cos_film;
  return out;
}

}  // namespace

void for_each_visible_splat(const CompiledScene& scene, const PhotonPass& pass, const PixelRect& tile,
                            std::vector<const Splat*>& splats, RenderCounters& counters,
                            const std::function<void(const VisibleSplat8&)>& take) {
  splats.clear();
  pass.splats.find(tile, splats);
  counters.gathered += splats.size();
  for (std::size_t i = 0; i < splats.size(); i += 8) {
    const Splats8 here = load_splats(scene, pass.photons, std::span(splats).subspan(i), tile);
    VisibleSplat8 seen;
    seen.number = here.number;
    seen.pixel = here.pixel;
    seen.photon = here.photon;
    seen.distance = here.distance;
    seen.direction = here.direction;
    const Connection8 connection = connect(scene, here.lanes, seen.photon, here.lens_point, seen.direction,
                                           seen.distance, scene.camera_media(), counters);
    seen.arrival = connection.arrival;
    seen.surface = connection.surface;
    seen.cosine = connection.cosine;
    seen.lanes = connection.reaches;
    if (seen.lanes.none()) {
      continue;
    }
    seen.per_power = here.weight * seen.cosine * here.film_distance2 / here.apart;
    seen.film_pdf_area = seen.cosine * here.film_distance2 / here.apart;
    take(seen);
  }
}

void for_each_visible_scatter(const CompiledScene& scene, const PhotonPass& pass, const PixelRect& tile,
                              std::vector<const Splat*>& splats, RenderCounters& counters,
                              const std::function<void(const VisibleScatter8&)>& take) {
  splats.clear();
  pass.media_splats.find(tile, splats);
  counters.gathered += splats.size();
  const MediumTable& table = scene.media();
  for (std::size_t i = 0; i < splats.size(); i += 8) {
    const Splats8 here = load_splats(scene, pass.in_media, std::span(splats).subspan(i), tile);
    const Arrival8 arrival = trace_transmittance(scene, here.lanes, {here.lens_point, here.direction, here.distance},
                                                 scene.camera_media(), {}, kNoGeometry, counters);
    VisibleScatter8 seen;
    seen.lanes = and_not(here.lanes, arrival.hits.hit | (here.distance < F8(pass.near)));
    seen.pixel = here.pixel;
    seen.photon = here.photon;
    const U8 medium = here.photon.primitive;
    const HenyeyGreenstein8 phase{table.anisotropy(medium)};
    seen.power = here.photon.power * table.scattering(medium) * arrival.transmittance;
    seen.value = seen.power * (phase.pdf_solid_angle(-here.direction, here.photon.wi) * here.weight *
                               here.film_distance2 / here.apart);
    if (seen.lanes.any()) {
      take(seen);
    }
  }
}

void finish_meter(tracer::Wavefront& wavefront, const PhotonPass& pass, MeterColumns& columns) {
  const PixelRect& tile = wavefront.tile();
  const std::uint32_t meter = meter_of(tile);
  for (const MeterHit& hit : pass.meters[meter]) {
    // A part of a meter's tile is a rectangle of its pixels.
    const int x = static_cast<int>(hit.pixel) % kTileSize - tile.x;
    const int y = static_cast<int>(hit.pixel) / kTileSize - (tile.y - meter_rect(meter).y);
    if (x >= 0 && x < tile.width && y >= 0 && y < tile.height) {
      wavefront.add_photons(first_lanes(1), U8(static_cast<std::uint32_t>(y * tile.width + x)), broadcast(hit.value),
                            U8(hit.group));
    }
  }
  columns.finish_sample(wavefront);
}

GatherDiscs::GatherDiscs(const tracer::Wavefront& wavefront, const PhotonPass& pass, const FoundPhotons& found,
                         F8 radius, const tracer::Vertex8& vertex)
    : pass_(pass),
      found_(found),
      radius_(radius),
      surface_(vertex.surface),
      most_scatterings_(wavefront.max_bounces() - vertex.bounce + 1) {
  counts_ = counts_of(found);
  if (wavefront.scene().features().opacity) {
    // Photons stop with the probability of the opacity, and so do camera paths. Without this factor the opacity would
    // count twice.
    const M8 lanes = signed_less(U8(0u), counts_);
    opacity_ = select(lanes, wavefront.scene().materials().opacity(surface_, lanes), F8(1.0f));
  }
  size_ = most_of(found);
}

GatherDiscs::Term8 GatherDiscs::term(std::uint32_t k) const {
  constexpr float kMinCosine = 0.8f, kMaxHeight = 0.25f;  ///< between normals; in radii
  Term8 term;
  term.number = numbers_of(found_, k);
  const M8 there = signed_less(U8(k), counts_);
  term.photon = load_photons(pass_.photons, term.number, there);
  const V8 off = term.photon.point - surface_.point;
  const F8 height = abs(dot(off, surface_.geometric_normal)), half = radius_ * F8(0.5f);
  term.valid = there & (dot(term.photon.normal, surface_.geometric_normal) > F8(kMinCosine)) &
               (height < radius_ * F8(kMaxHeight)) & signed_less(term.photon.scatterings, most_scatterings_);
  term.inside = (length_squared(off) < half * half) & (height < half * F8(kMaxHeight));
  return term;
}

}  // namespace lightmill::photons
