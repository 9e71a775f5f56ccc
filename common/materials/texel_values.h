// Numbers that the pixels of textures stand for.
#pragma once

#include <cstdint>
#include <span>

#include "common/image/texels.h"

namespace lightmill {

/// Inverse of the sRGB transfer function on [0, 1] (IEC 61966-2-1). Its bits do not depend on the C library. Relative
/// error below 1e-12.
double srgb_decode_fixed(double encoded);

/// The values of all bytes, or of all 16-bit words, as such texels have them. Integers are divided by the largest one.
/// `decode`: sRGB values become linear; half floats are first clamped to [0, 1].
std::span<const float> texel_values(const Texels& texels, bool decode);

/// Finds the byte or word whose value is nearest, for texels of the same format.
class TexelEncoder {
 public:
  TexelEncoder(const Texels& texels, bool decode);
  std::uint32_t operator()(float value) const;

 private:
  bool rounds_half_;                  ///< values are half floats
  std::span<const float> values_;     ///< else: ascending from 0 to 1
  std::vector<std::uint32_t> first_;  ///< of the values above i / kCells
};

/// Linear colours of texels that are sRGB-encoded floats (clamped to [0, 1]).
Texels decode_floats(const Texels& texels);

}  // namespace lightmill
