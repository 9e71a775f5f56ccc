// Smaller copies of an image, for lookups that average over many of its texels (Williams 1983, "Pyramidal Parametrics").
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/texels.h"
#include "common/math/simd.h"

namespace lightmill {

/// Level 1 has half the width and height of the image, rounded up, level 2 half of level 1, down to one texel. A texel
/// of a level is the mean of the image's linear colours over its area, clamped to [0, 1] as reflectances are.
/// Immutable, thread-safe.
class TexturePyramid {
 public:
  enum class Weight {
    area,
    alpha,  ///< colours count by their alpha: what lies behind a cut-out shape does not tint its edge
  };
  /// `decode`: as in TextureSettings.
  TexturePyramid(const Texels& image, bool decode, Weight weight);

  /// All levels, one after the other, in the format of the image. They are rounded to the nearest linear colour.
  const Texels& texels() const { return texels_; }
  std::uint32_t levels() const { return static_cast<std::uint32_t>(width_.size()); }

  struct Level8 {
    U8 width, height;
    U8 first;  ///< texel
  };
  /// Levels count from 1. There must be this level in each lane of the mask.
  Level8 at(U8 level, M8 lanes) const {
    const U8 row = level - U8(1u);
    return {gather(width_.data(), row, lanes), gather(height_.data(), row, lanes), gather(first_.data(), row, lanes)};
  }

 private:
  Texels texels_;
  std::vector<std::uint32_t> width_, height_, first_;  ///< one per level
};

/// Memory of an image's pyramid.
std::uint64_t pyramid_bytes(int width, int height, std::uint32_t bytes_per_pixel);
/// The same while it is made, with two levels in single precision.
std::uint64_t pyramid_peak_bytes(int width, int height, std::uint32_t bytes_per_pixel);

}  // namespace lightmill
