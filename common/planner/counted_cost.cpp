#include "common/planner/counted_cost.h"

namespace lightmill {
namespace {

/// Costs in rays, fitted to the CPU time of path and caustic on all of scenes/, with 1024 to 16384 photons per pass.
/// Each fit is within 11 % (tests/bench/planner_bench, docs/evidence/accuracy.md). Pixels add no cost to that of their
/// rays.
constexpr double kGather = 2.1;
constexpr double kGathered = 0.64;
constexpr double kPhoton = 1;
constexpr double kPhotonRay = 0.74;
constexpr double kStoredPhoton = 5.8;  ///< including its entries in the map and on the film

double times(double cost, std::uint64_t count) {
  return cost * static_cast<double>(count);
}

}  // namespace

CountedCost cost_of(const RenderCounters& c) {
  return {times(1, c.closest_hit_rays) + times(kShadowRayCost, c.shadow_rays) + times(kGather, c.gathers) +
              times(kGathered, c.gathered),
          times(kPhoton, c.photons) + times(kPhotonRay, c.photon_rays) + times(kStoredPhoton, c.stored_photons)};
}

}  // namespace lightmill
