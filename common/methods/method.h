// Rendering method: a pure function of compiled scene, settings, tile and sample range.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/film/layers.h"
#include "common/film/node.h"
#include "common/film/tile_grid.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

struct MethodSettings {
  std::string name = "path";  ///< with parameters, as spec/method_spec.h describes
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;               ///< scatterings of a path, at most; 0: the method's own limit
  std::vector<LayerSpec> layers{LayerSpec{}};  ///< of the film, as film_layers returns them
};

/// Work of rendering, summed over calls.
struct RenderCounters {
  std::uint64_t samples = 0;
  std::uint64_t closest_hit_rays = 0;  ///< without those of photons
  std::uint64_t shadow_rays = 0;
  std::uint64_t gathers = 0;   ///< photon searches
  std::uint64_t gathered = 0;  ///< photons found by searches or tested for visibility

  // Work that all tiles of a sample share, counted by the thread that does it.
  std::uint64_t photons = 0;
  std::uint64_t photon_rays = 0;     ///< closest-hit rays of photons
  std::uint64_t stored_photons = 0;  ///< stored photons
};

/// Scratch memory of one thread, reused between calls. Belongs to the method that made it.
class Workspace {
 public:
  virtual ~Workspace() = default;
  RenderCounters counters;
  std::stop_token stop;  ///< checked between bounces: render() returns early if a stop is requested
};

/// Immutable and thread-safe. Each thread uses its own workspace.
class Method {
 public:
  virtual ~Method() = default;
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  /// Renders one node. `tile` is a rectangle of the full film's pixels, at most kTileSize on a side. The node has the
  /// bits of its joined one-sample nodes. Thread, batch and lane do not affect them. Returns a node without values if
  /// `workspace.stop` was requested.
  virtual Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const = 0;
};

/// INVALID_ARGUMENT for an unknown method or parameter, or a layer that the method does not fill.
Result<std::unique_ptr<Method>> make_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings);

}  // namespace lightmill
