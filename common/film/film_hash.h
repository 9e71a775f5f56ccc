// The film hash: one number for all the pixels of a film, the same however it was rendered, stored or sent.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/digest.h"
#include "common/film/tile_grid.h"

namespace lightmill {

/// A whole film (its crop) as planes: per half the mean of that half's samples, and how many samples a pixel has.
///
/// `mean_a[channel * pixels + pixel]` with pixels of the crop row by row; a half without samples has mean 0. This is
/// what an EXR of the film stores, so its hash can be computed from the file.
struct FilmPlanes {
  FilmPlanes() = default;
  FilmPlanes(const PixelRect& crop, std::uint32_t channels);

  /// Puts a tile in: `sums` as in Node::values for `rect`, over `samples_a` + `samples_b` samples per pixel. A mean is
  /// the float32 quotient of a sum and its count. `rect` lies within the crop and the sizes fit (checked).
  void set_tile(const PixelRect& rect, std::span<const float> sums, std::uint64_t samples_a, std::uint64_t samples_b);

  PixelRect crop;
  std::uint32_t channels = 0;
  std::vector<float> mean_a, mean_b;  ///< of beauty
  std::vector<std::uint32_t> counts;  ///< samples of both halves, per pixel
  /// The other layers' planes as an EXR of the film holds them, one after the other; none in a film of beauty alone.
  std::vector<float> layers;
  /// meter_hash of each virtual meter.
  std::vector<Hash128> meters;
};

/// The same planes where they lie.
struct FilmPlanesView {
  FilmPlanesView() = default;
  FilmPlanesView(const FilmPlanes& planes)  // NOLINT(google-explicit-constructor): as a span of a vector
      : mean_a(planes.mean_a),
        mean_b(planes.mean_b),
        counts(planes.counts),
        layers{planes.layers},
        meters(planes.meters) {}

  std::span<const float> mean_a, mean_b;
  std::span<const std::uint32_t> counts;
  std::vector<std::span<const float>> layers;  ///< each some planes
  std::span<const Hash128> meters;
};

/// XXH3-128 over mean_a, mean_b (float32 little-endian) and counts (uint32 little-endian), in this order; then, where
/// there are any, layers (float32 little-endian), and the meters' hashes (each as two uint64 little-endian, low first).
Hash128 film_hash(const FilmPlanesView& planes);

/// XXH3-128 over a meter's tile: how many samples half A and half B have (uint64 little-endian), and its sums as in
/// Node::values (float32 little-endian).
Hash128 meter_hash(std::span<const float> sums, std::uint64_t samples_a, std::uint64_t samples_b);

}  // namespace lightmill
