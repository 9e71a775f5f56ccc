// The layers of a film's picture besides beauty: their channels in EXR files, and how a tile's values become pixels.
//
//   direct, indirect, albedo  Direct.R/G/B, Indirect.R/G/B, Albedo.R/G/B: means over all samples
//   caustic, bias             Caustic.R/G/B, Bias.R/G/B: the same
//   light:NAME                Light.NAME.R/G/B: the same
//   normal                    N.X/Y/Z: the mean over samples 0 to 15, in the scene's frame; 0 where nothing is seen
//   depth                     Z: the nearest of samples 0 to 15; kNoDepth where nothing is seen
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

/// The depth of what is not there, as other renderers write it.
inline constexpr float kNoDepth = 1e10f;

/// A layer's planes over a picture's data window.
struct PictureLayer {
  std::string name;                   ///< as the film calls it
  std::vector<std::string> channels;  ///< as EXR files call them
  std::vector<float> values;          ///< `[channel][pixel]`
};

/// Whether the layer is a mean over all samples (else over samples 0 to 15).
bool is_mean_layer(std::string_view name);

/// A layer of so many pixels without samples. `name` must be one of those above.
PictureLayer make_picture_layer(const std::string& name, std::size_t pixels);

/// What ids in films stand for, and which of them were seen. They are indices of objects, from 1; 0 sees nothing.
class PictureIds {
 public:
  /// What a thing is known by.
  enum Kind : std::size_t { kObject, kMaterial };

  PictureIds() = default;
  /// The names of objects and of their materials, by object.
  PictureIds(std::vector<std::string> objects, std::vector<std::string> materials);

  /// The object that an id stands for, which counts as seen from now on; none if there is no such object.
  std::optional<std::size_t> see(float id);
  /// Of an object: its Cryptomatte identifier.
  float identifier(Kind kind, std::size_t object) const { return identifiers_[kind][object]; }
  /// The names of what was seen.
  std::set<std::string> seen(Kind kind) const;

 private:
  std::array<std::vector<std::string>, 2> names_;
  std::array<std::vector<float>, 2> identifiers_;
  std::vector<bool> seen_;
};

/// Puts a tile into layers that are made of samples 0 to 15. `values` holds, for `samples` samples of the tile's
/// pixels, `[normal channel][pixel]`, `[depth channel][pixel]`, `[sample][id][pixel]`, each if there is such a layer
/// among `layers`. Returns false, with nothing done, if there are not as many values or more samples.
bool place_first_samples(std::vector<PictureLayer>& layers, const ImageWindow& data, const ImageWindow& rect,
                         std::uint32_t samples, std::span<const float> values, PictureIds& ids);

/// What the header says of the `id` layer: the manifests of the objects and materials that were seen.
void add_id_attributes(std::map<std::string, ImageAttribute>& attributes, const PictureIds& ids);

}  // namespace lightmill
