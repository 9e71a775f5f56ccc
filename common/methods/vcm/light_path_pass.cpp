#include "common/methods/vcm/light_path_pass.h"

#include <numeric>

#include "common/methods/photons/photon_tracer.h"
#include "common/methods/vcm/densities.h"

namespace lightmill::vcm {
namespace {

struct LightPathPayload {
  Partial8 partial;  ///< before the first surface, vcm is the density of emission
  U8 light;          ///< at which it started
  F8 cosine;         ///< to the surface of this light
};
/// Eight light paths, with the inputs of their weights.
struct LightPath8 : LightPathPayload, photons::PhotonPath8 {
  struct AtVertex {
    Partial8 partial;  ///< on arrival
    F8 merging;        ///< the merging factor η
  };
};

/// Hooks of PhotonTracer (photons::PhotonPaths) for light paths.
class LightPaths {
 public:
  using Path = LightPath8;
  using Vertex = photons::PhotonVertex8<Path>;
  static constexpr bool kStoresAtCasters = true;
  static constexpr bool kScattersInMedia = false;

  LightPaths(const CompiledScene& scene, const PhotonEmission& emission, LightPathPass& pass)
      : scene_(scene), emission_(emission), pass_(pass) {}

  M8 start(const PhotonEmission::Photon8& emitted, Path& path, M8 lanes) const {
    path.partial.vcm = emission_.pdf(emitted.light, emitted.origin, emitted.direction, emitted.cosine, lanes);
    path.light = emitted.light;
    path.cosine = emitted.cosine;
    return lanes & (path.partial.vcm > F8(0.0f));  // rounding can put an origin off the disc of a distant light
  }

  static M8 counted(const Path& /*path*/, M8 lanes) { return lanes; }

  Path::AtVertex arrive(const Path& path, const Surface8& surface, M8 lanes, std::uint32_t number) const {
    return {arrived(path, surface.point, surface.geometric_normal, lanes, number), pass_.merging_factor(surface.point)};
  }

  template <class Bsdf>
  void leave(const Vertex& vertex, const Bsdf& bsdf, const BsdfSample8& sample, const V8& wo, Path& out,
             M8 lanes) const {
    const F8 cosine = abs(dot(out.direction, vertex.facing));
    out.partial = scatter_delta(vertex.at.partial, cosine);
    if constexpr (requires { bsdf.eval(wo, wo); }) {
      const F8 back = reverse_pdf(scene_, vertex.surface, vertex.arrival.crossing, bsdf, wo, sample.wi, lanes);
      out.partial =
          select(sample.pdf_solid_angle > F8(0.0f),
                 scatter(vertex.at.partial, vertex.at.merging, cosine, sample.pdf_solid_angle, back), out.partial);
    }
  }

  void store(const Vertex& vertex, M8 lanes) {
    alignas(32) float d_vcm[8], d_vc[8];
    vertex.at.partial.vcm.store(d_vcm);
    vertex.at.partial.vc.store(d_vc);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      pass_.d_vcm.push_back(d_vcm[i]);
      pass_.d_vc.push_back(d_vc[i]);
    }
  }

  /// The meter's own paths start there, cosine-distributed, one per pixel. A photon that crosses the meter is merged.
  F8 meter_weight(const Path& path, const V8& point, const V8& normal, F8 area, F8 cosine, M8 lanes,
                  std::uint32_t number) const {
    constexpr std::uint32_t kPixels = kTileSize * kTileSize;
    const F8 merging = area * F8(static_cast<float>(pass_.plan.photons) / kPixels);
    return merged({F8(0.0f), F8(0.0f)}, arrived(path, point, normal, lanes, number), merging, cosine * F8(kInvPi),
                  F8(0.0f));
  }

 private:
  /// Partial sums on arrival at a point.
  Partial8 arrived(const Path& path, const V8& point, const V8& normal, M8 lanes, std::uint32_t number) const {
    const F8 cosine = max(abs(dot(path.direction, normal)), F8(1e-8f));
    if (number > 1) {
      return vcm::arrive(path.partial, length_squared(point - path.origin), cosine);
    }
    LightDensities8 light =
        light_densities(scene_, emission_, path.light, point, path.origin, path.direction, path.cosine, lanes);
    light.emission = path.partial.vcm;
    return first_arrival(light, cosine);
  }

  const CompiledScene& scene_;
  const PhotonEmission& emission_;
  LightPathPass& pass_;
};

/// Sorts photons by path. The photons of one path are in order, but mixed with those of others.
void sort_by_path(LightPathPass& pass) {
  pass.path_first.assign(pass.plan.photons + 1, 0);
  for (const photons::Photon& photon : pass.photons) {
    ++pass.path_first[photon.path + 1];
  }
  std::partial_sum(pass.path_first.begin(), pass.path_first.end(), pass.path_first.begin());
  std::vector<std::uint32_t> next = pass.path_first;
  pass.path_photons.resize(pass.photons.size());
  for (std::uint32_t i = 0; i < pass.photons.size(); ++i) {
    pass.path_photons[next[pass.photons[i].path]++] = i;
  }
}

}  // namespace

void LightPathPass::trace(const CompiledScene& scene, const photons::PhotonSource& source, RenderCounters& counters,
                          const std::stop_token& stop) {
  // Merging radii grow with the distance from the camera, between these multiples of the scene's radius.
  constexpr float kMinDistance = 1.0f / 256, kMaxDistance = 8;
  const auto extent = static_cast<float>(scene.caustic_targets().scene.radius) * plan.radius_per_length;
  merging = {scene.camera().position, plan.radius_per_length, kMinDistance * extent, kMaxDistance * extent};
  LightPaths paths(scene, source.emission, *this);
  photons::PhotonTracer(scene, source, paths, *this, counters).run(stop);
  sort_by_path(*this);
}

std::uint64_t LightPathPass::bytes() const {
  return sizeof(LightPathPass) + PhotonPass::bytes() + merge_map.bytes() +
         4 * (d_vcm.size() + d_vc.size() + path_first.size() + path_photons.size());
}

}  // namespace lightmill::vcm
