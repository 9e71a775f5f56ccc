#include "common/methods/photons/gathering.h"

namespace lightmill::photons {

void for_each_visible_splat(const CompiledScene& scene, const PhotonPass& pass, const PixelRect& tile,
                            std::vector<const Splat*>& splats, RenderCounters& counters,
                            const std::function<void(const VisibleSplat8&)>& take) {
  splats.clear();
  pass.splats.find(tile, splats);
  counters.gathered += splats.size();
  const CameraBasis& camera = scene.camera();
  const F8 film_distance2(1.0f / glm::dot(camera.right, camera.right));
  for (std::size_t i = 0; i < splats.size(); i += 8) {
    alignas(32) std::uint32_t number[8] = {}, pixel[8] = {};
    alignas(32) float weight[8] = {}, x[8] = {}, y[8] = {}, z[8] = {};
    const std::size_t count = std::min<std::size_t>(splats.size() - i, 8);
    for (std::size_t k = 0; k < count; ++k) {
      const Splat& splat = *splats[i + k];
      number[k] = splat.photon;
      pixel[k] = static_cast<std::uint32_t>((splat.y - tile.y) * tile.width + splat.x - tile.x);
      weight[k] = splat.weight;
      x[k] = splat.lens_point.x;
      y[k] = splat.lens_point.y;
      z[k] = splat.lens_point.z;
    }
    const M8 lanes = first_lanes(static_cast<int>(count));
    const V8 lens_point{F8::load(x), F8::load(y), F8::load(z)};
    VisibleSplat8 seen;
    seen.number = U8::load(number);
    seen.pixel = U8::load(pixel);
    seen.photon = load_photons(pass.photons, seen.number, lanes);
    const V8 way = seen.photon.point - lens_point;
    seen.distance = sqrt(length_squared(way));
    seen.direction = way * (F8(1.0f) / seen.distance);
    const Connection8 connection =
        connect(scene, lanes, seen.photon, lens_point, seen.direction, seen.distance, scene.camera_media(), counters);
    seen.arrival = connection.arrival;
    seen.surface = connection.surface;
    seen.cosine = connection.cosine;
    seen.lanes = connection.reaches;
    if (seen.lanes.none()) {
      continue;
    }
    const F8 cos_film = dot(seen.direction, broadcast(camera.forward));
    const F8 apart = seen.distance * seen.distance * cos_film * cos_film * cos_film;
    seen.per_power = F8::load(weight) * seen.cosine * film_distance2 / apart;
    seen.film_pdf_area = seen.cosine * film_distance2 / apart;
    take(seen);
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
  alignas(32) std::uint32_t counts[8];
  for (std::size_t lane = 0; lane < 8; ++lane) {
    counts[lane] = static_cast<std::uint32_t>(found[lane].size());
  }
  counts_ = U8::load(counts);
  if (wavefront.scene().features().opacity) {
    // Photons stop with the probability of the opacity, and so do camera paths. Without this factor the opacity would
    // count twice.
    const M8 lanes = signed_less(U8(0u), counts_);
    opacity_ = select(lanes, wavefront.scene().materials().opacity(surface_, lanes), F8(1.0f));
  }
  size_ = *std::ranges::max_element(counts);
}

GatherDiscs::Term8 GatherDiscs::term(std::uint32_t k) const {
  constexpr float kMinCosine = 0.8f, kMaxHeight = 0.25f;  ///< between normals; in radii
  alignas(32) std::uint32_t numbers[8] = {};
  for (std::size_t lane = 0; lane < 8; ++lane) {
    if (k < found_[lane].size()) {
      numbers[lane] = found_[lane][k];
    }
  }
  Term8 term;
  term.number = U8::load(numbers);
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
