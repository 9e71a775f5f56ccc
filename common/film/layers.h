// Layers that a film can have, and the layout of their values in a node.
// Summed layers merge like beauty. The others come only from samples 0 to 15 of a pixel:
//   normal    mean of the visible shading normals
//   features  moments per half (methods/film_channels.h)
//   depth     smallest visible depth
//   id        the object of each sample
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/film/sample_range.h"

namespace lightmill {

inline constexpr int kBeautyChannels = 3;           ///< R, G, B
inline constexpr std::uint32_t kFirstSamples = 16;  ///< samples of the layers that are not summed
inline constexpr std::size_t kMaxLightGroups = 8;   ///< light groups of one film, without `light:rest`
inline constexpr std::size_t kMaxSceneLightGroups = 1000;
inline constexpr std::size_t kMaxLightGroupName = 64;  ///< bytes

enum class LayerKind {
  summed,         ///< sums over all samples, per half
  first_mean,     ///< means over the first samples; nodes hold the sums
  first_nearest,  ///< the smallest positive value of the first samples; 0 if none
  first_samples,  ///< the first samples, in order
};

/// One layer of the film.
struct LayerSpec {
  std::string name = "beauty";
  std::uint32_t channels = 3;
  LayerKind kind = LayerKind::summed;
  friend bool operator==(const LayerSpec&, const LayerSpec&) = default;
};

inline constexpr std::string_view kBeautyLayer = "beauty";

/// Prefix of light groups' layers, and the layer of all light in none of the requested groups.
inline constexpr std::string_view kLightLayerPrefix = "light:";
inline constexpr std::string_view kRestLayer = "light:rest";

/// Dependence of photon gathering on its radius. The error estimate derives the bias from it.
inline constexpr std::string_view kBiasLayer = "bias";

/// The light group in a layer's name; empty for other layers.
std::string_view light_group_of(std::string_view layer);

/// Letters, digits, '-' and '_', at most kMaxLightGroupName of them. "rest" is reserved.
bool is_light_group_name(std::string_view name);

/// The film's layers for these names, in the order of every film: beauty, direct, indirect, caustic, bias, albedo,
/// light groups as given and the rest of the light, normal, features, depth, id. INVALID_ARGUMENT for an unknown or
/// repeated name, or too many groups.
Result<std::vector<LayerSpec>> film_layers(std::span<const std::string> names);

/// INVALID_ARGUMENT unless film_layers can return this list.
Status check_layers(const std::vector<LayerSpec>& layers);

/// INVALID_ARGUMENT for a layer that the method does not fill. `caustic` fills all layers. `path`, `vcm` and `auto`
/// fill all but `caustic`. `bias` is zero for a method without bias. The other methods fill the layers that show
/// surfaces, and `ppm` also `bias`.
Status check_method_layers(std::string_view method, const std::vector<LayerSpec>& layers);

/// All layers that the method fills, with those of these light groups.
std::vector<LayerSpec> all_layers(std::string_view method, std::span<const std::string> groups);

/// INVALID_ARGUMENT for a layer of a light group that is not in `groups`.
Status check_light_groups(const std::vector<LayerSpec>& layers, std::span<const std::string> groups);

/// Whether the method follows light over any number of surfaces. Such a method fills the layers of light groups.
bool method_follows_all_light(std::string_view method);

/// Whether the method reads the scene's virtual meters. Films of other methods have no tiles for meters.
bool method_reads_meters(std::string_view method);

/// Position of a layer among those of its kind.
struct LayerSlice {
  LayerKind kind = LayerKind::summed;
  std::uint32_t first = 0;  ///< channel
  std::uint32_t channels = kBeautyChannels;
  friend bool operator==(const LayerSlice&, const LayerSlice&) = default;
};

/// Position of a layer among these layers, which are in film order; empty if it is not there.
std::optional<LayerSlice> layer_slice(std::string_view layer, const std::vector<LayerSpec>& layers);

/// Layout of a node's values. First come the summed channels of both halves, `[half][channel][pixel]`. Nodes that begin
/// before sample 16 then have the other layers over their samples below 16: `[first_mean channel][pixel]`,
/// `[first_nearest channel][pixel]`, `[sample][first_samples channel][pixel]`.
struct NodeLayout {
  std::uint32_t summed = kBeautyChannels;  ///< channels
  std::uint32_t first_mean = 0;
  std::uint32_t first_nearest = 0;
  std::uint32_t first_samples = 0;
  int bias = -1;  ///< first channel of this layer among the summed ones; −1 without

  NodeLayout(std::uint32_t summed_channels = kBeautyChannels) : summed(summed_channels) {}
  explicit NodeLayout(const std::vector<LayerSpec>& layers);

  /// Number of first samples in a range.
  static std::uint32_t first_samples_in(const SampleRange& range) {
    return range.first() >= kFirstSamples
               ? 0
               : static_cast<std::uint32_t>(std::min<std::uint64_t>(range.end(), kFirstSamples) - range.first());
  }
  bool has_first() const { return first_mean + first_nearest + first_samples > 0; }
  std::size_t summed_values() const { return std::size_t{2} * summed; }  ///< a pixel
  std::size_t first_values(std::uint32_t samples) const {                ///< a pixel
    return samples == 0 ? 0 : first_mean + first_nearest + std::size_t{first_samples} * samples;
  }
  /// Values per pixel of a node.
  std::size_t values(const SampleRange& range) const { return summed_values() + first_values(first_samples_in(range)); }
  std::size_t most_values() const { return summed_values() + first_values(kFirstSamples); }  ///< per pixel, of any node
  friend bool operator==(const NodeLayout&, const NodeLayout&) = default;
};

/// Appends the first-sample values of a node to those of an earlier one, as joining nodes does. `into` has
/// `into_samples` samples before, and `into_samples + samples` after.
void append_first(const NodeLayout& layout, std::size_t pixels, std::vector<float>& into, std::uint32_t into_samples,
                  std::span<const float> values, std::uint32_t samples);

}  // namespace lightmill
