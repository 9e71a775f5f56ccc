// Textures: what a surface's coordinates mean in an image.
//
// u grows to the right of the image and v upwards: (0, 0) is its lower left corner, (1, 1) its upper right one. Texel
// centres stand at half-integers. Coordinates are scaled and moved first (u' = u · scale + offset).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/image/texels.h"
#include "common/math/vec.h"

namespace lightmill {

enum class TextureFilter { nearest, bilinear };
enum class TextureWrap { repeat, clamp };  ///< beyond [0, 1]: the image again, or its border

struct TextureSettings {
  TextureFilter filter = TextureFilter::bilinear;
  TextureWrap wrap = TextureWrap::repeat;
  bool decode = false;  ///< colours of texels that are bytes are sRGB-encoded; floats are linear
  std::array<float, 2> scale{1, 1};
  std::array<float, 2> offset{0, 0};
};

/// One image and how it is looked up. Immutable, thread-safe.
class Texture {
 public:
  Texture(std::shared_ptr<const Texels> texels, const TextureSettings& settings);

  struct Rgba8 {
    V8 rgb;  ///< linear
    F8 alpha;
  };
  /// Coordinates are finite and below 1e9.
  Rgba8 lookup(F8 u, F8 v, M8 lanes) const;
  /// Mean colour over the image.
  Vec3 mean() const;
  const Texels& texels() const { return *texels_; }

 private:
  Rgba8 texel(U8 x, U8 y, M8 lanes) const;
  F8 wrapped(F8 coordinate) const;
  U8 wrapped_index(U8 index, std::uint32_t size) const;

  std::shared_ptr<const Texels> texels_;
  TextureSettings settings_;
  std::array<float, 256> decoded_{};  ///< colour of a byte
};

/// The sRGB transfer function's inverse on [0, 1] (IEC 61966-2-1) with bits that do not depend on the C library;
/// relative error below 1e-12.
double srgb_decode_fixed(double encoded);

/// The same pixels with linear colours, of texels that are sRGB-encoded floats (cut to [0, 1]).
Texels decode_floats(const Texels& texels);

/// All textures of a scene; eight lanes may ask for different ones.
class TextureSet {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  void add(Texture texture) { textures_.push_back(std::move(texture)); }
  const Texture& operator[](std::uint32_t i) const { return textures_[i]; }
  /// Memory of the texels; what several textures share counts once.
  std::uint64_t bytes() const;
  /// Where `texture` is kNone: white and opaque.
  Texture::Rgba8 lookup(U8 texture, F8 u, F8 v, M8 lanes) const;

 private:
  std::vector<Texture> textures_;
};

}  // namespace lightmill
