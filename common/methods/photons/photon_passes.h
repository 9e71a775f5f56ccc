// Photon passes of `caustic`, `ppm` and `photon-dots`, and passes of light paths of `vcm`: one a sample index. The last
// ones are cached.
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

/// One pass, with what finds its photons. Immutable.
struct PhotonPass {
  std::vector<Photon> photons;
  FilmSplats splats;
  std::vector<std::vector<MeterHit>> meters;
  PhotonKind kind = PhotonKind::caustic;
  MergeRadii merging;                        ///< of light paths; of others only its camera position counts
  std::uint32_t emitted = 0;                 ///< photons that started, those without power among them
  const PhotonEmission* emission = nullptr;  ///< of the PhotonPasses that have traced it

  // Of light paths.
  std::vector<float> d_vcm, d_vc;           ///< by photon: vcm::Partial8
  std::vector<std::uint32_t> path_first;    ///< by path: its first entry of `path_photons`; one more at the end
  std::vector<std::uint32_t> path_photons;  ///< numbers of photons, path by path in the order of their scatterings
  MergeMap merge_map;                       ///< of all photons
  vcm::Partial8 partials(U8 number, M8 lanes) const {
    return {gather(d_vcm.data(), number, lanes), gather(d_vc.data(), number, lanes)};
  }
  F8 merging_factor(const V8& p) const { return merging.factor(p, emitted); }

  float point_meter_radius_per_distance = 0;
  float meter_area(const MeterPlace& meter) const;
  float photon_power = 0;  ///< as photons start: the mean of all and of the channels
  // Of photons that are gathered.
  PhotonMap first, later;       ///< photons that had met casters alone, and others; of PhotonKind::global all are first
  float radius_per_length = 0;  ///< of gathers among `first`, over the length of the camera path
  float least = 0, most = 0;    ///< limits of these radii
  static constexpr float kLater = 4;  ///< radii among `later` over those among `first`
  /// Among `first`, of camera paths of this length.
  F8 gather_radius(F8 path_length) const { return min(max(path_length * F8(radius_per_length), F8(least)), F8(most)); }
  std::uint64_t bytes() const;
};

struct PhotonPassSettings {
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;
  std::uint32_t photons = 0;  ///< of a pass; fewer where they would leave more than kMostStored; 0: default_photons
  double radius = 0;          ///< of gathers in the first pass, in pixels; 0: default_radius
  PhotonKind kind = PhotonKind::caustic;
  bool splats = true;  ///< the camera's view of photons is wanted
};
PhotonPassSettings pass_settings(const MethodSettings& settings, const MethodSpec& spec, PhotonKind kind);
/// Pixels. Light paths have a small one: merging matters for few of them, and blurs all. At most a twentieth of the
/// distance from the camera, because a few pixels of a small picture may be as wide as a room.
double default_radius(const CompiledScene& scene, PhotonKind kind);
/// By the number of the film's pixels, within limits.
std::uint32_t default_photons(const CompiledScene& scene, PhotonKind kind);
/// Stored photons of a pass, on average at most. Where more would be stored (in closed rooms that absorb hardly any
/// light), fewer photons start. Each is followed to its end, so no light is lost.
inline constexpr std::uint32_t kMostStored = 1u << 20;

/// A pass depends only on scene, settings and sample index. The first thread that needs a pass traces it. Other threads
/// wait, or trace the next one. The cache holds kHeldPassBytes of passes, the last used; those in use live as long as
/// they are used. Thread-safe.
class PhotonPasses {
 public:
  PhotonPasses(const CompiledScene& scene, const PhotonPassSettings& settings);
  /// No light starts photons: camera paths find all light.
  bool empty() const { return source_.emission.empty(); }
  /// Photons that start in a pass.
  std::uint32_t photons() const { return settings_.photons; }
  /// The pass of a sample index. The thread may trace others of [sample, end) while it would wait. Null if the
  /// workspace was asked to stop.
  std::shared_ptr<const PhotonPass> pass(std::uint64_t sample, std::uint64_t end, Workspace& workspace) const;
  /// Traces the pass, cached or not. Null if `stop` was requested.
  std::shared_ptr<const PhotonPass> trace(std::uint64_t sample, RenderCounters& counters,
                                          const std::stop_token& stop = {}) const;

 private:
  std::uint32_t photons_of_pass(std::uint32_t wanted) const;

  struct Held {
    std::shared_ptr<const PhotonPass> pass;  ///< null while a thread traces it
    std::uint64_t used = 0;                  ///< number of the call that used it last
  };
  /// The pass that the caller must trace, if any: `sample` or one after it.
  std::optional<std::uint64_t> claim(std::uint64_t sample, std::uint64_t end) const LM_REQUIRES(mutex_);
  void finish(std::uint64_t sample, std::shared_ptr<const PhotonPass> pass) const LM_EXCLUDES(mutex_);

  const CompiledScene& scene_;
  PhotonPassSettings settings_;
  PhotonSource source_;
  mutable Mutex mutex_;
  mutable CondVar changed_;
  mutable std::map<std::uint64_t, Held> held_ LM_GUARDED_BY(mutex_);
  mutable std::uint64_t bytes_ LM_GUARDED_BY(mutex_) = 0;
  /// Bytes of the largest pass. Threads trace no more passes ahead than the cache holds.
  mutable std::uint64_t heaviest_ LM_GUARDED_BY(mutex_) = 0;
  mutable std::uint64_t calls_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill::photons
