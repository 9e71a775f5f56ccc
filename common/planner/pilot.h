// A pilot: a few samples by each of several methods, to find out which is the cheapest for a picture.
#pragma once

#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "common/film/tile_grid.h"
#include "common/planner/pilot_choice.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

struct PilotSettings {
  std::vector<std::string> methods;  ///< with their parameters, the simplest first
  std::uint64_t seed = 0;            ///< of the job; the pilot's own numbers are others, so that it never enters a film
  std::uint32_t max_bounces = 0;
  PixelRect film;  ///< all of it, also for jobs that render a part: that has the bits that it has in the whole
};

/// Renders small patches all over the film, in two independent batches, on the calling thread. A pure function of its
/// arguments. INVALID_ARGUMENT if a method cannot be made; CANCELLED if it was stopped, which it does between bounces.
Result<PilotChoice> run_pilot(const std::shared_ptr<const CompiledScene>& scene, const PilotSettings& settings,
                              const std::stop_token& stop = {});

/// The patches: at most 64 of at most 8×8 pixels, spread evenly.
std::vector<PixelRect> pilot_patches(const PixelRect& film);

}  // namespace lightmill
