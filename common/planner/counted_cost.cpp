#include "common/planner/counted_cost.h"

namespace lightmill {
namespace {

/// In rays. As fitted to the CPU time of path and caustic on nine scenes, by 1024 to 16384 photons a pass, one by one
/// within 13 % (tests/bench/planner_bench, docs/measurements.md): pixels and photons add nothing to what their rays
/// cost.
constexpr double kGather = 4.6;
constexpr double kGathered = 0.4;
constexpr double kPhotonRay = 1.05;
constexpr double kDeposit = 5.3;  ///< with its places in the map and on the film

double times(double cost, std::uint64_t count) {
  return cost * static_cast<double>(count);
}

}  // namespace

CountedCost cost_of(const RenderCounters& c) {
  return {times(1, c.closest_hit_rays) + times(kShadowRayCost, c.shadow_rays) + times(kGather, c.gathers) +
              times(kGathered, c.gathered),
          times(kPhotonRay, c.photon_rays) + times(kDeposit, c.deposits)};
}

}  // namespace lightmill
