// Where a film's layers lie among the channels that a method fills, and what all methods put into those that show
// surfaces. What the layers mean:
//
//   direct    light that surfaces scatter at most once between its source and the camera: sources themselves, their
//             images in mirrors, and surfaces lit by them
//   indirect  all other light
//   caustic   of it, what has come from its source over mirrors, glass and the like to another surface: all that the
//             light side of the method of that name brings
//   bias      what gathers of photons bring less what they would bring with half the radius, of the same photons
//   light:G   light of light group G; light:rest that of all lights that are in no group asked for
//   albedo    the reflectance of the surface that the camera ray hits first, whatever its kind (1 for clear glass)
//   normal    its shading normal on the camera's side, in the scene's frame; with `flat` the geometric one
//   depth     its distance from the plane through the camera that faces along the view ("camera z"), in scene units
//   id        1 + the index of its object in the document
// A camera ray that hits nothing gives 0 to the last four.
#pragma once

#include <vector>

#include "common/film/layers.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Planes of samples by layer: first channels among the summed ones, or among those of samples 0 to 15 (in NodeLayout's
/// order). −1: the film has no such layer.
struct FilmChannels {
  FilmChannels() : FilmChannels(std::vector<LayerSpec>{LayerSpec{}}) {}
  /// `layers` as film_layers gives them; `light_groups` are the scene's, as CompiledScene numbers them.
  explicit FilmChannels(const std::vector<LayerSpec>& layers, const std::vector<std::string>& light_groups = {});

  NodeLayout layout;
  int direct = -1, indirect = -1, caustic = -1, bias = -1, albedo = -1;
  int normal = -1, depth = -1, id = -1;

  /// By the number of a light group: the first channel of its layer, or of light:rest. Empty without such layers.
  std::vector<int> light;

  bool separates_lights() const { return !light.empty(); }
  bool shows_surfaces() const { return albedo >= 0 || layout.has_first(); }
};

/// Planes of one sample: of the summed channels (`summed_stride` values each), and of those of samples 0 to 15
/// (`first_stride` values each; null from sample 16 on).
struct SamplePlanes {
  float* summed = nullptr;
  std::size_t summed_stride = 0;
  float* first = nullptr;
  std::size_t first_stride = 0;
};

/// Puts what camera rays hit first into the planes, at the pixels `pixel`.
void store_surfaces(const FilmChannels& channels, const CompiledScene& scene, const Hit8& hits, const Surface8& surface,
                    U8 pixel, const SamplePlanes& planes);

}  // namespace lightmill
