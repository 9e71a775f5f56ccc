// Textures: images, and their lookup by a surface's coordinates.
//
// u points right and v up. (0, 0) is the image's lower left corner, (1, 1) its upper right one. Texel centres are at
// half-integers. Coordinates are mapped first.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/materials/texel_values.h"
#include "common/materials/texture_pyramid.h"
#include "common/math/vec.h"

namespace lightmill {

enum class TextureFilter { nearest, bilinear };
/// Outside [0, 1]: the image repeats, its border continues, or it repeats with every second copy mirrored.
enum class TextureWrap { repeat, clamp, mirror };

struct TextureSettings {
  TextureFilter filter = TextureFilter::bilinear;
  std::array<TextureWrap, 2> wrap{};  ///< along u and v
  bool decode = false;                ///< colours are sRGB-encoded, but for floats, which are always linear
  std::array<std::array<float, 2>, 2> matrix{{{1, 0}, {0, 1}}};  ///< of (u, v), row by row
  std::array<float, 2> offset{0, 0};                             ///< added to the product
};

/// An image with its lookup settings. Immutable, thread-safe.
class Texture {
 public:
  Texture(std::shared_ptr<const Texels> texels, const TextureSettings& settings);

  struct Rgba8 {
    V8 rgb;  ///< linear
    F8 alpha;
  };
  /// Coordinates must be finite and below 1e9.
  Rgba8 lookup(F8 u, F8 v, M8 lanes) const { return lookup(u, v, F8(0.0f), lanes); }
  /// The mean around (u, v) over about `footprint`, a length in the same coordinates, if the texture has a pyramid. It
  /// comes from one level, whose texels are half as wide as the footprint or more. The levels do not blend, because
  /// footprints are smaller than what is seen.
  Rgba8 lookup(F8 u, F8 v, F8 footprint, M8 lanes) const {
    const auto [x, y] = mapped(u, v);
    return lookup_mapped(x, y, footprint, lanes);
  }
  /// The coordinates of the image.
  std::pair<F8, F8> mapped(F8 u, F8 v) const;
  /// The same lookup at mapped coordinates. The footprint is in those before they are mapped.
  Rgba8 lookup_mapped(F8 u, F8 v, F8 footprint, M8 lanes) const;
  struct Slopes8 {
    Rgba8 u, v;
  };
  /// The slopes of the bilinear image per unit of u and of v, averaged over one texel.
  Slopes8 slopes(F8 u, F8 v, M8 lanes) const {
    const auto [x, y] = mapped(u, v);
    return slopes_mapped(x, y, lanes);
  }
  /// The same slopes at mapped coordinates.
  Slopes8 slopes_mapped(F8 u, F8 v, M8 lanes) const;
  /// Mean colour of the image.
  Vec3 mean() const;
  const Texels& texels() const { return *texels_; }
  bool decodes() const { return settings_.decode; }

  /// A pyramid of the texels, for lookups with footprints.
  TexturePyramid make_pyramid(TexturePyramid::Weight weight) const { return {*texels_, settings_.decode, weight}; }
  /// It must have a level.
  void use_pyramid(std::shared_ptr<const TexturePyramid> pyramid);
  const TexturePyramid* pyramid() const { return pyramid_.get(); }

 private:
  Rgba8 texel(const Texels& texels, U8 index, M8 lanes) const;
  /// Coordinates are those of the image.
  Rgba8 nearest(F8 u, F8 v, M8 lanes) const;
  Rgba8 bilinear(F8 u, F8 v, M8 lanes) const;
  Rgba8 bilinear(const Texels& texels, const TexturePyramid::Level8& level, F8 u, F8 v, M8 lanes) const;

  std::shared_ptr<const Texels> texels_;
  std::shared_ptr<const TexturePyramid> pyramid_;  ///< or none
  TextureSettings settings_;
  float texels_per_unit_;  ///< of length in the coordinates before they are mapped, where the texels are widest
  std::span<const float> colors_, alphas_;  ///< texel_values, unless there are floats
};

/// All textures of a scene. Each of eight lanes may have another texture.
class TextureSet {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  void add(Texture texture) {
    has_pyramids_ |= texture.pyramid() != nullptr;
    textures_.push_back(std::move(texture));
  }
  /// The image `image`, which has been added, is for the square of u and v that begins at (square mod 10, square / 10)
  /// of `texture`. A texture with tiles has no other image, not even its own.
  void set_tile(std::uint32_t texture, std::uint32_t square, std::uint32_t image) { tiles_[texture][square] = image; }
  bool has_pyramids() const { return has_pyramids_; }
  const Texture& operator[](std::uint32_t i) const { return textures_[i]; }
  /// Mean colour of the image, or of all tiles.
  Vec3 mean(std::uint32_t texture) const;
  /// Memory of the texels and pyramids. Shared ones count once.
  std::uint64_t bytes() const;
  /// White and opaque where `texture` is kNone. Black and transparent where it has no tile.
  Texture::Rgba8 lookup(U8 texture, F8 u, F8 v, M8 lanes) const { return lookup(texture, u, v, F8(0.0f), lanes); }
  Texture::Rgba8 lookup(U8 texture, F8 u, F8 v, F8 footprint, M8 lanes) const;
  /// 0 where `texture` is kNone.
  Texture::Slopes8 slopes(U8 texture, F8 u, F8 v, M8 lanes) const;

 private:
  static constexpr std::uint32_t kColumns = 10, kRows = 100;

  /// Calls `visit(image, u, v, lanes)` for each of the images, with their mapped coordinates.
  template <class Visit>
  void for_each_image(U8 texture, F8 u, F8 v, M8 lanes, const Visit& visit) const;

  std::vector<Texture> textures_;
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> tiles_;  ///< images by texture and square
  bool has_pyramids_ = false;
};

}  // namespace lightmill
