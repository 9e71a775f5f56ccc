// Layers of a film's picture besides beauty: their channels in EXR files, and the pixels of a tile's values.
//
//   direct, indirect, albedo  Direct.R/G/B, Indirect.R/G/B, Albedo.R/G/B: means over all samples
//   caustic, bias             Caustic.R/G/B, Bias.R/G/B: the same
//   light:NAME                Light.NAME.R/G/B: the same
//   normal                    N.X/Y/Z: mean over samples 0 to 15, in the scene's frame; 0 where nothing is hit
//   features                  Features.A.Albedo.R …: sums over the samples of one half among samples 0 to 15, divided
//                             by the number of samples of both halves
//   depth                     Z: the smallest of samples 0 to 15; kNoDepth where nothing is hit
//   id                        CryptoObject00.R … and CryptoMaterial00.R …: Cryptomatte over samples 0 to 15
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/image.h"

namespace lightmill {

/// Depth where nothing is hit, as other renderers write it.
inline constexpr float kNoDepth = 1e10f;

/// A layer's planes over a picture's data window.
struct PictureLayer {
  std::string name;                   ///< as in the film
  std::vector<std::string> channels;  ///< as in EXR files
  std::vector<float> values;          ///< `[channel][pixel]`
};

/// Whether the layer is a mean over all samples; otherwise it is from samples 0 to 15.
bool is_mean_layer(std::string_view name);

/// Whether the layer can be shown as a picture. Ids and features cannot.
bool is_shown_layer(std::string_view name);

/// A layer of `pixels` pixels without samples. `name` must be one of those above.
PictureLayer make_picture_layer(const std::string& name, std::size_t pixels);

/// Objects and materials of a film's ids, and which of them were seen. An id is the index of an object, from 1. 0 is no
/// object.
class PictureIds {
 public:
  /// The kind of thing that a name identifies.
  enum Kind : std::size_t { kObject, kMaterial };

  PictureIds() = default;
  /// Names of objects and of their materials, by object.
  PictureIds(std::vector<std::string> objects, std::vector<std::string> materials);

  /// The object of an id, which is marked as seen; empty if there is none.
  std::optional<std::size_t> see(float id);
  /// Cryptomatte identifier of an object or its material.
  float identifier(Kind kind, std::size_t object) const { return identifiers_[kind][object]; }
  /// Names of the things that were seen.
  std::set<std::string> seen(Kind kind) const;

 private:
  std::array<std::vector<std::string>, 2> names_;
  std::array<std::vector<float>, 2> identifiers_;
  std::vector<bool> seen_;
};

/// Stores a tile in the layers of samples 0 to 15. `values` has, for `samples` samples of the tile's pixels, `[normal
/// channel][pixel]`, `[features channel][pixel]`, `[depth channel][pixel]`, `[sample][id][pixel]`, each if `layers` has
/// this layer. Returns false and does nothing if the number of values is wrong, or there are more samples.
bool place_first_samples(std::vector<PictureLayer>& layers, const ImageWindow& data, const ImageWindow& rect,
                         std::uint32_t samples, std::span<const float> values, PictureIds& ids);

/// Adds the header attributes of the `id` layer: manifests of the objects and materials that were seen.
void add_id_attributes(std::map<std::string, ImageAttribute>& attributes, const PictureIds& ids);

}  // namespace lightmill
