// A method: how light is computed. A pure function of (compiled scene, seed, tile, sample range).
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/film/layers.h"
#include "common/film/node.h"
#include "common/film/tile_grid.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

struct MethodSettings {
  std::string name = "path";  ///< and its parameters: see spec/method_spec.h
  std::uint64_t seed = 0;
  std::uint32_t max_bounces = 0;  ///< of methods that follow light: scatterings at most; 0: their own limits
  std::vector<LayerSpec> layers{LayerSpec{}};  ///< of the film, as film_layers gives them
};

/// What rendering cost, for those who want to know; adds up over calls.
struct RenderCounters {
  std::uint64_t samples = 0;
  std::uint64_t closest_hit_rays = 0;  ///< photons' apart
  std::uint64_t shadow_rays = 0;
  std::uint64_t gathers = 0;   ///< searches for photons
  std::uint64_t gathered = 0;  ///< photons found, and those tested for pixels that may see them

  // What all tiles of a sample share, counted where it is done.
  std::uint64_t photons = 0;
  std::uint64_t photon_rays = 0;  ///< closest hits
  std::uint64_t deposits = 0;     ///< stored photons
};

/// Scratch memory of one thread, reused between calls; belongs to the method that made it.
class Workspace {
 public:
  virtual ~Workspace() = default;
  RenderCounters counters;
  std::stop_token stop;  ///< asked between bounces: render() returns at once when it says so
};

/// Immutable and thread-safe; each thread brings its own workspace.
class Method {
 public:
  virtual ~Method() = default;
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  /// Renders one node: `tile` is a rectangle of pixels of the full film, of at most kTileSize on a side. The node's
  /// bits are those of joining its one-sample nodes, whatever the thread, batch or lane. A node without values if
  /// `workspace.stop` was requested.
  virtual Node render(const PixelRect& tile, SampleRange range, Workspace& workspace) const = 0;
};

/// INVALID_ARGUMENT for an unknown method or parameter, or a layer that the method does not fill.
Result<std::unique_ptr<Method>> make_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings);

}  // namespace lightmill
