// Film hash: a hash of all pixels of a film. Rendering, storage and transport do not change it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/digest.h"

namespace lightmill {

/// A whole film (its crop) as planes: the mean of each half's samples, and the number of samples per pixel.
///
/// `mean_a[channel * pixels + pixel]`, with the crop's pixels row by row. An empty half has mean 0, else the mean is
/// the float32 quotient of sum and count. An EXR of the film stores the same values, so its hash can be computed from
/// the file.
struct FilmPlanesView {
  std::span<const float> mean_a, mean_b;  ///< of beauty
  std::span<const std::uint32_t> counts;  ///< samples of both halves, by pixel
  /// The planes of each other layer as in an EXR of the film. Empty in a film of beauty alone.
  std::vector<std::span<const float>> layers;
  std::span<const Hash128> meters;  ///< meter_hash of each virtual meter
};

/// XXH3-128 over mean_a, mean_b (float32 little-endian) and counts (uint32 little-endian), in this order. Then follow
/// the layers (float32 little-endian) and the meters' hashes (each as two uint64 little-endian, low first), if any.
Hash128 film_hash(const FilmPlanesView& planes);

/// XXH3-128 over a meter's tile: the sample counts of half A and half B (uint64 little-endian), and its sums as in
/// Node::values (float32 little-endian).
Hash128 meter_hash(std::span<const float> sums, std::uint64_t samples_a, std::uint64_t samples_b);

}  // namespace lightmill
