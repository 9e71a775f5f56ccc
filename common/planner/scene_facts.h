// Facts of a scene on which the choice of method depends. They come from the document and, for the size of small
// lights, from mesh assets.
//
// Only materials and textures in use count. Facts that only assets could tell count as the harder case: a black
// texture, overlapping shapes, a mirror that no light reaches.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/document.h"

namespace lightmill {

/// Names of some of a scene's objects or lights, in the document's order.
struct NamedItems {
  static constexpr std::size_t kMaxNames = 8;
  std::size_t count = 0;
  std::vector<std::string> names;  ///< of the first ones, as in messages: "the point light 'bulb'", "the glass 'ball'"

  void add(std::string name);
  bool empty() const { return count == 0; }
  std::string text() const;  ///< "the glass 'a', the glass 'b' and 3 more"; "none"
};

struct SceneFacts {
  /// Lights without a size, which camera paths never hit. Spots count only if they may shine on something that
  /// scatters narrowly.
  NamedItems delta_lights;
  std::size_t sized_lights = 0;  ///< lights that are no surfaces, but have a size
  /// Sampled emitters and lights with a size that are small: they fill less than kSmallShare of all directions, as seen
  /// from each object that scatters narrowly. Only known positions count. Of a million paths through these objects,
  /// almost none hits such an emitter.
  NamedItems small_emitters;
  NamedItems distant_lights;  ///< directional lights and image environments; photons from there cover a bounded region
  std::size_t emissive_objects = 0;
  enum class Environment { none, constant, image } environment = Environment::none;

  NamedItems casters;           ///< as in casters.h: all light from them forms caustics
  NamedItems smooth_casters;    ///< casters that scatter narrowly (narrow_lobes), at least in part
  NamedItems infinite_casters;  ///< planes among all casters
  NamedItems smooth_layers;     ///< scatter narrowly, but are no casters, such as a smooth lacquer
  NamedItems infinite_layers;   ///< planes among them
  bool receivers = false;       ///< surfaces, media or meters that show caustics

  NamedItems unsampled_emitters;  ///< emissive planes, spheres with an emission texture, and emitters whose opacity
                                  ///< varies; only rays that happen to hit them find their light
  /// Small ones among them: they fill less than kSmallShare of all directions, as seen from each object that scatters
  /// narrowly, or from each object that receives light. Only known positions count.
  NamedItems hidden_emitters;
  bool planes = false;  ///< infinite planes
  /// Approximate share of photons spread over the scene that land in one pixel: (pixel angle · distance)² / (2 ·
  /// radius)². The radius is that of the sphere around all objects with a known position. The distance is from the
  /// camera to the sphere's centre, and at least the radius.
  double pixel_share = 1;

  bool absorption = false;     ///< in a medium
  bool scattering = false;     ///< in a medium
  std::size_t boundaries = 0;  ///< objects that light enters
  bool ranked_media = false;   ///< a priority, or an index of 1: the renderer must track media
  bool textures = false, normal_maps = false, anisotropy = false, sheen = false, mixtures = false, thin_sheets = false,
       shadow_catchers = false, lens = false;
  NamedItems see_through;  ///< materials with an opacity below 1
  std::size_t meters = 0;
  NamedItems point_meters;    ///< irradiance meters
  double largest_albedo = 0;  ///< largest channel of any surface; a bound with textures
  /// Some channel is absorbed by no surface and no medium. In a closed room its light never ends.
  bool lossless = false;

  std::uint64_t steps = 0;  ///< work of finding positions and sizes. Those beyond a limit of steps are unknown.
};

inline constexpr double kSmallShare = 1e-5;

/// Bytes of mesh assets, if they are available and few (kMaxBytes).
struct MeshSource {
  static constexpr std::uint64_t kMaxBytes = 1 << 16;  ///< an emitter with so many triangles is rarely small
  std::function<std::optional<std::string>(const Sha256&)> bytes;
};

/// `scene` must be valid. Without `meshes`, positions and sizes of meshes are unknown.
SceneFacts read_facts(const Scene& scene, const MeshSource& meshes = {});

/// Parts of the renderer that this scene uses: "light sampling", "media" …
std::vector<std::string> features_of(const SceneFacts& facts);

}  // namespace lightmill
