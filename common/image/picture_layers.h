// The layers of a film's picture besides beauty: their channels in EXR files, and how a tile's values become pixels.
//
//   direct, indirect, albedo  Direct.R/G/B, Indirect.R/G/B, Albedo.R/G/B: means over all samples
//   light:NAME                Light.NAME.R/G/B: the same
//   normal                    N.X/Y/Z: the mean over samples 0 to 15, in the scene's frame; a sample that sees nothing
//   is 0 depth                     Z: the nearest of samples 0 to 15; kNoDepth where nothing is seen id
//   CryptoObject00.R … and CryptoMaterial00.R …: Cryptomatte over samples 0 to 15
#pragma once

#include <cstdint>
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

/// What objects and materials are called, by object. Ids in films are indices of objects, from 1; 0 sees nothing.
struct IdNames {
  std::vector<std::string> objects, materials;
};

/// Puts a tile into layers that are made of samples 0 to 15. `values` holds, for `samples` samples of the tile's
/// pixels,
/// `[normal channel][pixel]`, `[depth channel][pixel]`, `[sample][id][pixel]`, each if there is such a layer among
/// `layers`. Returns false, with nothing done, if there are not as many values. Names that are seen are added to
/// `seen`.
bool place_first_samples(std::vector<PictureLayer>& layers, const ImageWindow& data, const ImageWindow& rect,
                         std::uint32_t samples, std::span<const float> values, const IdNames& names,
                         std::array<std::set<std::string>, 2>& seen);

/// What the header says of the `id` layer: the manifests of the objects and materials that were seen.
void add_id_attributes(std::map<std::string, ImageAttribute>& attributes,
                       const std::array<std::set<std::string>, 2>& seen);

}  // namespace lightmill
