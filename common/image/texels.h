// Pixels of a texture in memory, as rendering uses them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

/// An immutable array whose copies share their elements. A vector holds them, or memory that `owner` keeps alive.
template <class T>
class SharedArray {
 public:
  SharedArray() = default;
  SharedArray(std::vector<T> values) {
    auto held = std::make_shared<const std::vector<T>>(std::move(values));
    values_ = *held;
    owner_ = std::move(held);
  }
  SharedArray(std::shared_ptr<const void> owner, std::span<const T> values)
      : owner_(std::move(owner)), values_(values) {}

  const T& operator[](std::size_t i) const { return values_[i]; }
  const T* data() const { return values_.data(); }
  std::size_t size() const { return values_.size(); }
  bool empty() const { return values_.empty(); }
  auto begin() const { return values_.begin(); }
  auto end() const { return values_.end(); }
  friend bool operator==(const SharedArray& a, const SharedArray& b) { return std::ranges::equal(a, b); }

 private:
  std::shared_ptr<const void> owner_;
  std::span<const T> values_;
};

/// Pixels in rows from the top, with four channels: red, green, blue, alpha. Grey images have equal colours. Alpha is 1
/// in images without alpha. One of the three arrays is filled.
struct Texels {
  int width = 0;
  int height = 0;
  SharedArray<std::uint32_t> bytes;       ///< one per pixel, red in the lowest 8 bits, values as in the file
  SharedArray<float> floats;              ///< four per pixel
  bool encoded = false;                   ///< values are sRGB-encoded, unless the scene says otherwise
  SharedArray<std::uint64_t> words = {};  ///< one per pixel, red in the lowest 16 bits, values as in the file
  bool half = false;                      ///< words are half floats, not integers
};

/// The bits of one channel, of pixels in bytes or words.
inline std::uint32_t component(const Texels& texels, std::size_t pixel, std::size_t channel) {
  return texels.words.empty() ? texels.bytes[pixel] >> (8 * channel) & 0xff
                              : static_cast<std::uint32_t>(texels.words[pixel] >> (16 * channel)) & 0xffff;
}

inline std::uint32_t bytes_per_pixel(const Texels& texels) {
  return !texels.bytes.empty() ? 4 : !texels.words.empty() ? 8 : 16;
}

/// Default limit of an image's pixels.
inline constexpr std::int64_t kMaxTexturePixels = std::int64_t{1} << 28;

/// Memory of the pixels.
inline std::uint64_t size_bytes(const Texels& texels) {
  return std::uint64_t{texels.bytes.size()} * 4 + std::uint64_t{texels.words.size()} * 8 +
         std::uint64_t{texels.floats.size()} * 4;
}

/// INVALID_ARGUMENT, naming the first pixel that is infinite or NaN.
Status check_finite(const Texels& texels);

/// RESOURCE_EXHAUSTED for an image of more than `max_pixels`.
Status check_pixels(int width, int height, std::int64_t max_pixels);

}  // namespace lightmill
