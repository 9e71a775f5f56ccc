// Pilot: a few samples by each of several methods, to find the cheapest for a picture.
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "common/film/tile_grid.h"
#include "common/planner/pilot_choice.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

struct PilotSettings {
  std::vector<std::string> methods;  ///< with parameters, simplest first
  std::uint64_t seed = 0;            ///< the job's; the pilot derives another, so that its samples never enter a film
  std::uint32_t max_bounces = 0;
  PixelRect film;  ///< the full film, also for jobs with a crop, because a crop has the same bits
};

/// Renders small patches over the whole film in two independent batches, on the calling thread. A pure function of its
/// arguments. INVALID_ARGUMENT if a method cannot be made. CANCELLED if stopped, which is checked between bounces.
Result<PilotChoice> run_pilot(const std::shared_ptr<const CompiledScene>& scene, const PilotSettings& settings,
                              const std::stop_token& stop = {});

/// The patches: at most 64 of at most 8×8 pixels, evenly spaced.
std::vector<PixelRect> pilot_patches(const PixelRect& film);

}  // namespace lightmill
