// Channels of the film's layers, and the layers that show surfaces, which all methods fill alike.
//
//   direct    light that surfaces scatter at most once between its source and the camera: sources, their images in
//             mirrors, and surfaces that they light directly
//   indirect  all other light
//   caustic   the part of it that goes from a light via mirrors or glass to another surface: the photons of `caustic`
//   bias      gathered photons, minus the estimate from the same photons with half the radius
//   light:G   light of light group G. light:rest is the light of all lights in no requested group
//   albedo    reflectance of the first surface, whatever its kind (1 for clear glass)
//   normal    its shading normal on the camera's side, in the scene's frame. With `flat`, the geometric normal
//   features  input of a reconstruction: for half A, then for half B, the sums of the surface's albedo, of its normal
//             and of 1/depth (7 channels), and of their squared lengths (3 channels)
//   depth     its distance from the camera's plane, along the view direction ("camera z"), in scene units
//   id        1 + the index of its object in the document
// The last five are 0 where a camera ray hits nothing.
#pragma once

#include <vector>

#include "common/film/layers.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// First channel of each layer, among the summed channels, or among those of samples 0 to 15 (in NodeLayout's order).
/// −1: the film has no such layer.
struct FilmChannels {
  FilmChannels() : FilmChannels(std::vector<LayerSpec>{LayerSpec{}}) {}
  /// `layers`: as film_layers returns them. `light_groups`: the scene's, as CompiledScene numbers them.
  explicit FilmChannels(const std::vector<LayerSpec>& layers, const std::vector<std::string>& light_groups = {});

  NodeLayout layout;
  int direct = -1, indirect = -1, caustic = -1, bias = -1, albedo = -1;
  int normal = -1, features = -1, depth = -1, id = -1;

  /// First channel of a light group's layer, or of light:rest, by the group's number. Empty without such layers.
  std::vector<int> light;

  bool separates_lights() const { return !light.empty(); }
  bool shows_surfaces() const { return albedo >= 0 || layout.has_first(); }
};

/// Planes of one sample: summed channels (`summed_stride` values each), and channels of samples 0 to 15 (`first_stride`
/// values each). `first` is null from sample 16 on.
struct SamplePlanes {
  float* summed = nullptr;
  std::size_t summed_stride = 0;
  float* first = nullptr;
  std::size_t first_stride = 0;
};

/// Stores the surfaces that camera rays hit first, at the pixels `pixel`.
void store_surfaces(const FilmChannels& channels, const CompiledScene& scene, const Hit8& hits, const Surface8& surface,
                    U8 pixel, const SamplePlanes& planes);

/// Completes the layer `features` of one sample: `first` has its 7 channels of half A, and gets the squared lengths.
/// Moves them to half B for a sample of that half.
void complete_features(const FilmChannels& channels, bool half_b, std::size_t pixels, std::span<float> first);

}  // namespace lightmill
