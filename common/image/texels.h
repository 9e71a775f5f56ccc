// The pixels of a texture as they are kept for rendering.
#pragma once

#include <cstdint>
#include <vector>

namespace lightmill {

/// Rows from the top, four channels a pixel (red, green, blue, alpha; grey images have equal colours, alpha 1 where
/// there is none). One of the two arrays is filled.
struct Texels {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> bytes;  ///< one a pixel, red in the lowest 8 bits, values as in the file
  std::vector<float> floats;         ///< four a pixel
  bool encoded = false;              ///< the file's values are sRGB-encoded unless the scene says otherwise
};

/// That an image may have unless a caller says less.
inline constexpr std::int64_t kMaxTexturePixels = std::int64_t{1} << 28;

/// Memory of the pixels.
inline std::uint64_t size_bytes(const Texels& texels) {
  return std::uint64_t{texels.bytes.size()} * 4 + std::uint64_t{texels.floats.size()} * 4;
}

}  // namespace lightmill
