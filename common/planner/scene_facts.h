// What a scene has of which methods differ: read off the document, almost without its assets (the extent of small lamps
// aside).
//
// Only what objects use counts. What only the assets could tell (that a texture is black, that two shapes overlap, that
// no light reaches a mirror) is taken for what is harder to render.
#pragma once

#include <functional>
#include <optional>
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
  /// Points and directions: no path from the camera ever meets them. Spots only if they may shine on what scatters
  /// narrowly.
  NamedThings delta_lights;
  /// Lamps that are sampled and fill less than kSmallShare of all directions as seen from every thing that scatters
  /// narrowly, as far as is known: of a million paths through those hardly any meets one.
  NamedThings small_lamps;
  NamedThings distant_lights;  ///< directions, and environments of an image: what photons from there cover is bounded
  std::size_t emissive_objects = 0;
  enum class Environment { none, constant, image } environment = Environment::none;

  NamedThings casters;            ///< of casters.h: all that they send on gathers in caustics
  NamedThings smooth_casters;     ///< those of them that scatter narrowly (narrow_lobes), if only in part
  NamedThings boundless_casters;  ///< planes among them all
  NamedThings smooth_layers;      ///< scatter narrowly, but are no casters: as a smooth lacquer over something
  NamedThings boundless_layers;   ///< planes among those
  bool receivers = false;         ///< surfaces, media or meters on which caustics are seen

  NamedThings lamps_never_sampled;  ///< what glows without end, and spheres that glow by a texture: light from there is
                                    ///< found by rays that happen to meet it alone
  /// Those of them that fill less than kSmallShare of all directions as seen from every thing that scatters narrowly,
  /// or from every thing that receives light, as far as is known.
  NamedThings hidden_lamps;
  bool planes = false;  ///< without end
  /// About how much of what is spread over the scene lands on what one pixel sees: (its angle · distance)² / (2 ·
  /// radius)², of the sphere around all of which it is known where it is, from the middle of the scene at least.
  double pixel_share = 1;

  bool absorption = false;     ///< in what fills a shape
  bool scattering = false;     ///< likewise
  std::size_t boundaries = 0;  ///< objects that light passes into
  bool ranked_media = false;   ///< a priority, or an index of 1: which medium is where must be known
  bool textures = false, holdouts = false, lens = false;
  std::size_t meters = 0;
  NamedThings point_meters;   ///< of irradiance
  double largest_albedo = 0;  ///< of any channel of any surface; a bound where there are textures
  /// Some channel of light is nowhere lost but out of the scene: in a closed room it goes on for ever.
  bool lossless = false;
};

inline constexpr double kSmallShare = 1e-5;

/// The bytes of a mesh's asset, where they are at hand and few (kMostBytes).
struct MeshSource {
  static constexpr std::uint64_t kMostBytes = 1 << 16;  ///< a lamp of so many triangles is seldom small
  std::function<std::optional<std::string>(const Sha256&)> bytes;
};

/// `scene` must be valid. Without `meshes`, where they are and how large is not known.
SceneFacts read_facts(const Scene& scene, const MeshSource& meshes = {});

/// Parts of the renderer that this scene switches on: "light sampling", "media" …
std::vector<std::string> features_of(const SceneFacts& facts);

}  // namespace lightmill
