// The layers of a film: what a job may ask for besides beauty, and how their values lie in a node.
//
// Summed layers are merged by the film's fixed sums, as beauty is. The others come from samples 0 to 15 of a pixel
// alone:
//   normal  the mean of the shading normals that are seen
//   depth   the nearest depth that is seen
//   id      what each of the samples sees
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/film/sample_range.h"

namespace lightmill {

inline constexpr int kBeautyChannels = 3;           ///< R, G, B.
inline constexpr std::uint32_t kFirstSamples = 16;  ///< what layers that are not summed are made of
inline constexpr std::size_t kMaxLightGroups = 8;   ///< light groups of one film, those not asked for apart
inline constexpr std::size_t kMaxSceneLightGroups = 1000;
inline constexpr std::size_t kMaxLightGroupName = 64;  ///< bytes

enum class LayerKind {
  summed,         ///< sums over all samples, per half
  first_mean,     ///< sums over the first samples
  first_nearest,  ///< the least positive value of the first samples; 0 where there is none
  first_samples,  ///< the first samples themselves, in order
};

/// One layer of the film.
struct LayerSpec {
  std::string name = "beauty";
  std::uint32_t channels = 3;
  LayerKind kind = LayerKind::summed;
  friend bool operator==(const LayerSpec&, const LayerSpec&) = default;
};

inline constexpr std::string_view kBeautyLayer = "beauty";

/// The prefix of light groups' layers, and the layer of all light that is in none of the groups asked for.
inline constexpr std::string_view kLightLayerPrefix = "light:";
inline constexpr std::string_view kRestLayer = "light:rest";

/// How much of what gathers of photons bring depends on their radius, of which the error's statement makes their bias.
inline constexpr std::string_view kBiasLayer = "bias";

/// The light group of a layer's name; empty for other layers.
std::string_view light_group_of(std::string_view layer);

/// Letters, digits, '-' and '_'; at most kMaxLightGroupName; "rest" is taken.
bool is_light_group_name(std::string_view name);

/// The film's layers for these names, in the one order that films have: beauty, direct, indirect, caustic, bias,
/// albedo, light groups in the order given and the rest of the light, normal, depth, id. INVALID_ARGUMENT for a name
/// that is unknown or comes twice, or too many groups.
Result<std::vector<LayerSpec>> film_layers(std::span<const std::string> names);

/// INVALID_ARGUMENT unless film_layers gives this list.
Status check_layers(const std::vector<LayerSpec>& layers);

/// INVALID_ARGUMENT if there is a layer that this method does not fill: `caustic` fills all, `path`, `vcm` and what
/// `auto` picks all but `caustic` (`bias` with zeros where the method has none), the others those that show surfaces,
/// and `ppm` also `bias`.
Status check_method_layers(std::string_view method, const std::vector<LayerSpec>& layers);

/// All layers that this method fills, with those of these light groups.
std::vector<LayerSpec> all_layers(std::string_view method, std::span<const std::string> groups);

/// INVALID_ARGUMENT if a light group's layer names none of `groups`.
Status check_light_groups(const std::vector<LayerSpec>& layers, std::span<const std::string> groups);

/// Whether this method reads the scene's virtual meters; the films of others have no tiles for them.
bool method_reads_meters(std::string_view method);

/// Where one layer lies among those of its kind.
struct LayerPlace {
  LayerKind kind = LayerKind::summed;
  std::uint32_t first = 0;  ///< channel
  std::uint32_t channels = kBeautyChannels;
  friend bool operator==(const LayerPlace&, const LayerPlace&) = default;
};

/// Of a layer of a film with these layers, in film order; none if there is no such layer.
std::optional<LayerPlace> place_of(std::string_view layer, const std::vector<LayerSpec>& layers);

/// How a node's values lie: first the summed channels of both halves, `[half][channel][pixel]`; then, in nodes that
/// begin before sample 16, the other layers over those of its samples: `[first_mean channel][pixel]`,
/// `[first_nearest channel][pixel]`, `[sample][first_samples channel][pixel]`.
struct NodeLayout {
  std::uint32_t summed = kBeautyChannels;  ///< channels
  std::uint32_t first_mean = 0;
  std::uint32_t first_nearest = 0;
  std::uint32_t first_samples = 0;
  int bias = -1;  ///< the first channel of the layer of that name, among the summed ones; −1 without

  NodeLayout(std::uint32_t summed_channels = kBeautyChannels) : summed(summed_channels) {}
  explicit NodeLayout(const std::vector<LayerSpec>& layers);

  /// Of the first samples, how many a range holds.
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
  /// Values a pixel of a node.
  std::size_t values(const SampleRange& range) const { return summed_values() + first_values(first_samples_in(range)); }
  std::size_t most_values() const { return summed_values() + first_values(kFirstSamples); }  ///< a pixel of any node
  friend bool operator==(const NodeLayout&, const NodeLayout&) = default;
};

/// Appends the first-sample values of one node to those of an earlier one, as joining nodes does: `into` holds
/// `into_samples` samples before and `into_samples + samples` after.
void append_first(const NodeLayout& layout, std::size_t pixels, std::vector<float>& into, std::uint32_t into_samples,
                  std::span<const float> values, std::uint32_t samples);

}  // namespace lightmill
