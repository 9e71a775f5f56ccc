// Photon passes of a method: one per sample index.
#pragma once

#include <functional>

#include "common/methods/method.h"
#include "common/methods/photons/pass_cache.h"
#include "common/methods/photons/photon_pass.h"

namespace lightmill::photons {

struct PhotonPassSettings {
  PhotonKind kind;
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;
  std::uint32_t photons = 0;  ///< per pass; fewer if more than kMaxStored would be stored; 0: default_photons
  double radius = 0;          ///< gather radius of the first pass, in pixels; 0: default_radius
};
PhotonPassSettings pass_settings(const MethodSettings& settings, const MethodSpec& spec, const PhotonKind& kind);
/// In pixels. The radius is at most 1/20 of the distance from the camera, because a few pixels of a small picture may
/// be as wide as a room.
double default_radius(const CompiledScene& scene, const PhotonKind& kind);
/// Proportional to the film's pixels, within limits.
std::uint32_t default_photons(const CompiledScene& scene, const PhotonKind& kind);
/// Gather radius in media over that on surfaces, in the first pass: fewer photons are near a point of a volume.
inline constexpr float kMediaRadius = 4;
/// Limit of this radius in the first pass, in mean free paths. Light in media changes over that length.
inline constexpr float kMediaFreePaths = 0.5;
/// Limit of a pass's mean number of stored photons. In closed rooms that absorb almost no light, fewer photons start,
/// so that each is still followed to its end.
inline constexpr std::uint32_t kMaxStored = 1u << 20;

/// The settings with defaults, and with no more photons than kMaxStored allows. `stored(plan)` is the number of
/// photons that a pass stores.
PhotonPassSettings completed(const CompiledScene& scene, PhotonPassSettings settings, const PhotonEmission& emission,
                             const std::function<std::size_t(const PhotonPassPlan&)>& stored);
/// The plan of the pass of a sample index.
PhotonPassPlan plan_of(const CompiledScene& scene, const PhotonPassSettings& settings, std::uint64_t sample);

/// A pass depends only on scene, settings and sample index. `Pass` is derived from PhotonPass. Thread-safe.
template <class Pass>
class PhotonPasses {
 public:
  PhotonPasses(const CompiledScene& scene, const PhotonPassSettings& settings)
      : scene_(scene),
        source_(photon_source(scene, settings.kind.caustic)),
        settings_(completed(scene, settings, source_.emission, [this](const PhotonPassPlan& plan) {
          RenderCounters counters;
          Pass pass;
          pass.plan = plan;
          pass.trace(scene_, source_, counters, {});
          return pass.stored();
        })) {}

  /// No light emits photons. Camera paths find all light.
  bool empty() const { return source_.emission.empty(); }
  const PhotonEmission& emission() const { return source_.emission; }
  /// Photons that start in a pass.
  std::uint32_t photons() const { return settings_.photons; }
  /// The pass of a sample index. While it waits, the thread may trace other passes of [sample, end). Null if the
  /// workspace's stop was requested.
  std::shared_ptr<const Pass> pass(std::uint64_t sample, std::uint64_t end, Workspace& workspace) const {
    return cache_.get(sample, end, workspace.stop,
                      [&](std::uint64_t next) { return trace(next, workspace.counters, workspace.stop); });
  }
  /// Traces the pass without using the cache. Null if `stop` was requested.
  std::shared_ptr<const Pass> trace(std::uint64_t sample, RenderCounters& counters,
                                    const std::stop_token& stop = {}) const {
    RenderCounters own;
    auto pass = std::make_shared<Pass>();
    pass->plan = plan_of(scene_, settings_, sample);
    pass->trace(scene_, source_, own, stop);
    if (stop.stop_requested()) {
      return nullptr;
    }
    counters.photons += pass->plan.photons;
    counters.photon_rays += own.closest_hit_rays;
    counters.stored_photons += pass->stored();
    if (pass->stored() > 0) {
      pass->index(scene_);
      if (pass->plan.kind.splats) {
        constexpr std::uint32_t kMediaSalt = 0x6d656469u;
        pass->splats = FilmSplats(scene_, pass->photons, pass->plan.seed);
        pass->media_splats = FilmSplats(scene_, pass->in_media, pass->plan.seed ^ kMediaSalt);
      }
    }
    return pass;
  }

 private:
  const CompiledScene& scene_;
  const PhotonSource source_;
  const PhotonPassSettings settings_;
  mutable PassCache<Pass> cache_;
};

}  // namespace lightmill::photons
