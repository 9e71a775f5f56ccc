// The light side of `caustic`, `vcm`, `ppm` and `photon-dots`: passes of photons (of `vcm` light paths), one a sample
// index, and the memory of those that were needed last.
#pragma once

#include <list>
#include <map>
#include <memory>

#include "common/base/mutex.h"
#include "common/methods/method.h"
#include "common/methods/photons/deposit_map.h"
#include "common/methods/photons/film_splats.h"
#include "common/methods/photons/merge_map.h"
#include "common/methods/photons/photon_tracer.h"
#include "common/methods/spec/method_spec.h"
#include "common/methods/vcm/weights.h"

namespace lightmill::photons {

/// What one pass of photons has left; immutable.
struct LightPass {
  std::vector<Deposit> deposits;
  FilmSplats splats;
  std::vector<std::vector<MeterHit>> meters;
  Followed followed = Followed::caustics;
  MergeRadii merging;                        ///< of paths; of all others its eye alone counts
  std::uint32_t photons = 0;                 ///< that were to start
  const PhotonEmission* emission = nullptr;  ///< of the light side that has traced it

  // Of paths alone.
  std::vector<float> d_vcm, d_vc;            ///< by deposit: see Partial8
  std::vector<std::uint32_t> path_first;     ///< by path, into `path_deposits`; and the end
  std::vector<std::uint32_t> path_deposits;  ///< path by path, in the order of the way
  MergeMap merge_map;                        ///< of all deposits
  vcm::Partial8 partials(U8 number, M8 lanes) const {
    return {gather(d_vcm.data(), number, lanes), gather(d_vc.data(), number, lanes)};
  }
  F8 merging_factor(const V8& p) const { return merging.factor(p, photons); }

  float point_meter_radius_per_distance = 0;
  float meter_area(const MeterPlace& meter) const;
  float photon_power = 0;  ///< the mean of photons as they start, and of the channels
  // Of photons that are gathered.
  DepositMap first, later;            ///< deposits after casters alone, and the others; of all light, all are first
  float radius_per_length = 0;        ///< of gathers among the first ones, by the length of the way from the eye
  float least = 0, most = 0;          ///< limits of these radii
  static constexpr float kLater = 4;  ///< radii among the others, in those among the first
  std::uint64_t bytes() const;
};

struct LightSideSettings {
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;
  std::uint32_t photons = 0;  ///< of a pass at most, see kMostDeposits; 0: default_photons
  double radius = 0;          ///< of gathers in the first pass, in pixels; 0: default_radius
  Followed followed = Followed::caustics;
  bool splats = true;  ///< are to be found
};
/// Pixels. Where paths are weighed against each other, merging matters for few of them: what a larger radius takes off
/// the noise of these it adds as blur to all others. Of what a small picture shows, a few pixels may be as wide as a
/// room: it is a twentieth of the distance from the eye at most.
double default_radius(const CompiledScene& scene, Followed followed);
/// One for so many pixels of the film, within limits.
std::uint32_t default_photons(const CompiledScene& scene, Followed followed);
/// Deposits of a pass (of light paths their vertices), on average at most: where photons would leave more (in closed
/// rooms that take hardly any light away), there are fewer photons. Each leaves all of its own, so nothing is lost.
inline constexpr std::uint32_t kMostDeposits = 1u << 20;

/// Passes are pure functions of the scene, the settings and the sample index; whoever needs one first traces it, the
/// others wait or trace what they need next. kHeldPassBytes of them are held for those who come later, the last used;
/// those in use stay whatever they are. Thread-safe.
class LightSide {
 public:
  LightSide(const CompiledScene& scene, const LightSideSettings& settings);
  /// No light reaches a caster: all light is the camera side's.
  bool empty() const { return source_.emission.empty(); }
  /// That start in each pass.
  std::uint32_t photons() const { return settings_.photons; }
  /// The pass of a sample index; others of [sample, end) may be traced rather than to wait. Null if the workspace was
  /// asked to stop.
  std::shared_ptr<const LightPass> pass(std::uint64_t sample, std::uint64_t end, Workspace& workspace) const;
  /// Traces the pass, whether it is held or not. Null if it was stopped.
  std::shared_ptr<const LightPass> trace(std::uint64_t sample, RenderCounters& counters,
                                         const std::stop_token& stop = {}) const;

 private:
  std::uint32_t photons_of_pass(std::uint32_t wanted) const;

  struct Held {
    std::shared_ptr<const LightPass> pass;  ///< null while somebody traces it
    std::uint64_t used = 0;                 ///< when last, counted in calls
  };
  /// What the caller is to trace, if anything: `sample`, or what comes after it.
  std::optional<std::uint64_t> claim(std::uint64_t sample, std::uint64_t end) const LM_REQUIRES(mutex_);
  void finish(std::uint64_t sample, std::shared_ptr<const LightPass> pass) const LM_EXCLUDES(mutex_);

  const CompiledScene& scene_;
  LightSideSettings settings_;
  PhotonSource source_;
  mutable Mutex mutex_;
  mutable CondVar changed_;
  mutable std::map<std::uint64_t, Held> held_ LM_GUARDED_BY(mutex_);
  mutable std::uint64_t bytes_ LM_GUARDED_BY(mutex_) = 0;
  mutable std::uint64_t heaviest_ LM_GUARDED_BY(mutex_) =
      0;  ///< bytes of a pass; no more are traced ahead than are held
  mutable std::uint64_t calls_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill::photons
