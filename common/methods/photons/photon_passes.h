// Cached photon passes of `caustic`, `ppm` and `photon-map`, and light-path passes of `vcm`. One pass per sample
// index.
#pragma once

#include <map>
#include <memory>

#include "common/base/mutex.h"
#include "common/methods/method.h"
#include "common/methods/photons/film_splats.h"
#include "common/methods/photons/merge_map.h"
#include "common/methods/photons/photon_map.h"
#include "common/methods/photons/photon_tracer.h"
#include "common/methods/spec/method_spec.h"
#include "common/methods/vcm/weights.h"

namespace lightmill::photons {

/// One pass, with the structures that find its photons. Immutable.
struct PhotonPass {
  std::vector<Photon> photons;
  FilmSplats splats;
  std::vector<std::vector<MeterHit>> meters;
  PhotonKind kind = PhotonKind::caustic;
  MergeRadii merging;                        ///< of light paths; other kinds use only its camera position
  std::uint32_t emitted = 0;                 ///< photons that started, with or without power
  const PhotonEmission* emission = nullptr;  ///< of the PhotonPasses that traced it

  // Of light paths only.
  std::vector<float> d_vcm, d_vc;           ///< vcm::Partial8 by photon
  std::vector<std::uint32_t> path_first;    ///< first entry of `path_photons` by path, and the end
  std::vector<std::uint32_t> path_photons;  ///< photon numbers by path, in the order of scattering
  MergeMap merge_map;                       ///< of all photons
  vcm::Partial8 partials(U8 number, M8 lanes) const {
    return {gather(d_vcm.data(), number, lanes), gather(d_vc.data(), number, lanes)};
  }
  F8 merging_factor(const V8& p) const { return merging.factor(p, emitted); }

  float point_meter_radius_per_distance = 0;
  float meter_area(const CompiledMeter& meter) const;
  float photon_power = 0;  ///< mean power of emitted photons, over photons and channels
  // Of gathered photons only.
  PhotonMap first, later;       ///< photons that met only casters before, and others; for PhotonKind::global all are in
                                ///< `first`
  float radius_per_length = 0;  ///< gather radius in `first` over the length of the camera path
  float least = 0, most = 0;    ///< limits of this radius
  static constexpr float kLater = 4;  ///< radius in `later` over the radius in `first`
  /// Gather radius in `first`, for camera paths of this length.
  F8 gather_radius(F8 path_length) const { return min(max(path_length * F8(radius_per_length), F8(least)), F8(most)); }
  std::uint64_t bytes() const;
};

struct PhotonPassSettings {
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;
  std::uint32_t photons = 0;  ///< per pass; fewer if more than kMostStored would be stored; 0: default_photons
  double radius = 0;          ///< gather radius of the first pass, in pixels; 0: default_radius
  PhotonKind kind = PhotonKind::caustic;
  bool splats = true;  ///< compute splats, for directly visible photons
};
PhotonPassSettings pass_settings(const MethodSettings& settings, const MethodSpec& spec, PhotonKind kind);
/// In pixels. Light paths have a small radius, because merging helps few of them and blurs all. The radius is at most
/// 1/20 of the distance from the camera, because a few pixels of a small picture may be as wide as a room.
double default_radius(const CompiledScene& scene, PhotonKind kind);
/// Proportional to the film's pixels, within limits.
std::uint32_t default_photons(const CompiledScene& scene, PhotonKind kind);
/// Limit of a pass's mean number of stored photons. In closed rooms that absorb almost no light, fewer photons start,
/// so that each is still followed to its end.
inline constexpr std::uint32_t kMostStored = 1u << 20;

/// A pass depends only on scene, settings and sample index. The first thread that needs a pass traces it. Other threads
/// wait, or trace the next one. The cache holds the last used passes, kHeldPassBytes in all. Passes in use stay alive.
/// Thread-safe.
class PhotonPasses {
 public:
  PhotonPasses(const CompiledScene& scene, const PhotonPassSettings& settings);
  /// No light emits photons. Camera paths find all light.
  bool empty() const { return source_.emission.empty(); }
  /// Photons that start in a pass.
  std::uint32_t photons() const { return settings_.photons; }
  /// The pass of a sample index. While it waits, the thread may trace other passes of [sample, end). Null if the
  /// workspace's stop was requested.
  std::shared_ptr<const PhotonPass> pass(std::uint64_t sample, std::uint64_t end, Workspace& workspace) const;
  /// Traces the pass without using the cache. Null if `stop` was requested.
  std::shared_ptr<const PhotonPass> trace(std::uint64_t sample, RenderCounters& counters,
                                          const std::stop_token& stop = {}) const;

 private:
  std::uint32_t photons_of_pass(std::uint32_t wanted) const;

  struct Held {
    std::shared_ptr<const PhotonPass> pass;  ///< null while a thread traces it
    std::uint64_t used = 0;                  ///< number of the last call that used it
  };
  /// The pass that the caller must trace, if any: `sample` or a later one.
  std::optional<std::uint64_t> claim(std::uint64_t sample, std::uint64_t end) const LM_REQUIRES(mutex_);
  void finish(std::uint64_t sample, std::shared_ptr<const PhotonPass> pass) const LM_EXCLUDES(mutex_);

  const CompiledScene& scene_;
  PhotonPassSettings settings_;
  PhotonSource source_;
  mutable Mutex mutex_;
  mutable CondVar changed_;
  mutable std::map<std::uint64_t, Held> held_ LM_GUARDED_BY(mutex_);
  mutable std::uint64_t bytes_ LM_GUARDED_BY(mutex_) = 0;
  /// Bytes of the largest pass. Threads trace only as many passes ahead as the cache holds.
  mutable std::uint64_t heaviest_ LM_GUARDED_BY(mutex_) = 0;
  mutable std::uint64_t calls_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill::photons
