// What a scene has of which methods differ: read off the document, without its assets.
//
// Only what objects use counts. What only the assets could tell (that a texture is black, that two shapes overlap, that
// no light reaches a mirror) is taken for what is harder to render.
#pragma once

#include <string>
#include <vector>

#include "common/scene/document.h"

namespace lightmill {

/// Some of a scene's things, in the document's order.
struct NamedThings {
  static constexpr std::size_t kMostNames = 8;
  std::size_t count = 0;
  std::vector<std::string> names;  ///< of the first, as reasons call them: "the point light 'bulb'", "the glass 'ball'"

  void add(std::string name);
  bool empty() const { return count == 0; }
  std::string text() const;  ///< "the glass 'a', the glass 'b' and 3 more"; "none"
};

struct SceneFacts {
  NamedThings delta_lights;  ///< points and directions: no path from the camera ever meets them
  std::size_t emissive_objects = 0;
  enum class Environment { none, constant, image } environment = Environment::none;

  NamedThings casters;         ///< of casters.h: all that they send on gathers in caustics
  NamedThings smooth_casters;  ///< those of them that scatter in single directions alone
  NamedThings smooth_layers;   ///< do so beside other scattering, as a lacquer without roughness
  bool receivers = false;      ///< surfaces, media or meters on which caustics are seen

  NamedThings lamps_never_sampled;  ///< what glows without end, and spheres that glow by a texture: light from there is
                                    ///< found by rays that happen to meet it alone
  bool planes = false;              ///< without end
  bool suns = false;                ///< directional lights

  bool absorption = false;     ///< in what fills a shape
  bool scattering = false;     ///< likewise
  std::size_t boundaries = 0;  ///< objects that light passes into
  bool ranked_media = false;   ///< a priority, or an index of 1: which medium is where must be known
  bool textures = false, holdouts = false, lens = false;
  std::size_t meters = 0;
  double largest_albedo = 0;  ///< of any channel of any surface; a bound where there are textures
  /// Some channel of light is nowhere lost but out of the scene: in a closed room it goes on for ever.
  bool lossless = false;
};

/// `scene` must be valid.
SceneFacts read_facts(const Scene& scene);

/// Parts of the renderer that this scene switches on: "light sampling", "media" …
std::vector<std::string> features_of(const SceneFacts& facts);

}  // namespace lightmill
