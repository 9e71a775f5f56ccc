#include "common/materials/texture.h"

#include <cmath>
#include <set>
#include <tuple>

#include "common/base/check.h"
#include "common/math/stretch.h"

namespace lightmill {
namespace {

F8 floor(F8 x) {
  return F8(_mm256_floor_ps(x.v));
}

/// Maps to [0, 1].
F8 wrapped(F8 coordinate, TextureWrap wrap) {
  if (wrap == TextureWrap::repeat) {
    return coordinate - floor(coordinate);
  }
  if (wrap == TextureWrap::mirror) {
    const F8 half = coordinate * F8(0.5f);
    const F8 turn = (half - floor(half)) * F8(2.0f);  // in [0, 2]
    return min(turn, F8(2.0f) - turn);
  }
  return min(max(coordinate, F8(0.0f)), F8(1.0f));
}

/// For indices from −1 to `size`. The mirrored neighbour of a border texel is itself.
U8 wrapped_index(U8 index, U8 size, TextureWrap wrap) {
  const M8 below = signed_less(index, U8(0u));
  const M8 above = ~signed_less(index, size);
  const U8 zero(0u), last = size - U8(1u);
  const bool repeat = wrap == TextureWrap::repeat;
  return select(below, repeat ? last : zero, select(above, repeat ? zero : last, index));
}

Texture::Rgba8 select(M8 mask, const Texture::Rgba8& yes, const Texture::Rgba8& no) {
  return {select(mask, yes.rgb, no.rgb), select(mask, yes.alpha, no.alpha)};
}

}  // namespace

Texture::Texture(std::shared_ptr<const Texels> texels, const TextureSettings& settings)
    : texels_(std::move(texels)), settings_(settings) {
  LM_CHECK(texels_->width > 0 && texels_->height > 0);
  const auto& [x, y] = settings_.matrix;
  const double width = texels_->width, height = texels_->height;
  texels_per_unit_ =
      static_cast<float>(least_stretch({{{x[0] * width, x[1] * width}, {y[0] * height, y[1] * height}}}));
  if (texels_->floats.empty()) {
    colors_ = texel_values(*texels_, settings_.decode);
    alphas_ = texel_values(*texels_, false);
  }
}

void Texture::use_pyramid(std::shared_ptr<const TexturePyramid> pyramid) {
  LM_CHECK(pyramid->levels() > 0);
  pyramid_ = std::move(pyramid);
}

Texture::Rgba8 Texture::texel(const Texels& texels, U8 index, M8 lanes) const {
  if (!texels.bytes.empty()) {
    const U8 packed = gather(texels.bytes.data(), index, lanes);
    const U8 low(0xffu);
    return {{gather(colors_.data(), packed & low, lanes), gather(colors_.data(), (packed >> 8) & low, lanes),
             gather(colors_.data(), (packed >> 16) & low, lanes)},
            to_float(packed >> 24) * F8(1.0f / 255)};
  }
  if (!texels.words.empty()) {
    const auto* const pairs = reinterpret_cast<const std::uint32_t*>(texels.words.data());
    const U8 first = index << 1, low(0xffffu);
    const U8 red_green = gather(pairs, first, lanes), blue_alpha = gather(pairs, first + U8(1u), lanes);
    return {{gather(colors_.data(), red_green & low, lanes), gather(colors_.data(), red_green >> 16, lanes),
             gather(colors_.data(), blue_alpha & low, lanes)},
            gather(alphas_.data(), blue_alpha >> 16, lanes)};
  }
  const U8 first = index << 2;
  const float* base = texels.floats.data();
  return {{gather(base, first, lanes), gather(base + 1, first, lanes), gather(base + 2, first, lanes)},
          gather(base + 3, first, lanes)};
}

std::pair<F8, F8> Texture::mapped(F8 u, F8 v) const {
  const auto along = [&](std::size_t axis) {
    const auto& [by_u, by_v] = settings_.matrix[axis];
    return u * F8(by_u) + v * F8(by_v) + F8(settings_.offset[axis]);
  };
  return {along(0), along(1)};
}

Texture::Rgba8 Texture::lookup_mapped(F8 u, F8 v, F8 footprint, M8 lanes) const {
  if (settings_.filter == TextureFilter::nearest) {
    return nearest(u, v, lanes);
  }
  const F8 texels = footprint * F8(texels_per_unit_);
  M8 many = pyramid_ != nullptr ? lanes & (texels >= F8(2.0f)) : M8();
  // The border of a clamped image continues, not that of its smaller copies.
  for (const auto& [at, wrap] : {std::pair{u, settings_.wrap[0]}, {v, settings_.wrap[1]}}) {
    if (wrap == TextureWrap::clamp) {
      many = many & (at >= F8(0.0f)) & (at <= F8(1.0f));
    }
  }
  if (many.none()) {
    return bilinear(u, v, lanes);
  }
  constexpr std::uint32_t kExponentOfOne = 127;
  const U8 level = (float_bits(texels) >> 23) - U8(kExponentOfOne), last(pyramid_->levels());
  const TexturePyramid::Level8 chosen = pyramid_->at(select(signed_less(last, level), last, level), many);
  const Rgba8 mean = bilinear(pyramid_->texels(), chosen, u, v, many);
  const M8 few = and_not(lanes, many);
  return few.none() ? mean : select(many, mean, bilinear(u, v, few));
}

/// u = 1 belongs to the last column, v = 1 to the top row, v = 0 to the bottom row.
Texture::Rgba8 Texture::nearest(F8 u, F8 v, M8 lanes) const {
  const auto width = static_cast<std::uint32_t>(texels_->width);
  const auto height = static_cast<std::uint32_t>(texels_->height);
  const F8 x = wrapped(u, settings_.wrap[0]) * F8(static_cast<float>(width));
  const F8 y = wrapped(v, settings_.wrap[1]) * F8(static_cast<float>(height));
  const auto within = [](F8 at, std::uint32_t size) {
    const U8 i = truncate(at), last(size - 1);  // sizes above 2^24 have no exact float
    return select(signed_less(last, i), last, i);
  };
  return texel(*texels_, (U8(height - 1) - within(y, height)) * U8(width) + within(x, width), lanes);
}

Texture::Rgba8 Texture::bilinear(F8 u, F8 v, M8 lanes) const {
  const U8 width(static_cast<std::uint32_t>(texels_->width)), height(static_cast<std::uint32_t>(texels_->height));
  return bilinear(*texels_, {width, height, U8(0u)}, u, v, lanes);
}

Texture::Rgba8 Texture::bilinear(const Texels& texels, const TexturePyramid::Level8& level, F8 u, F8 v,
                                 M8 lanes) const {
  const auto [wrap_u, wrap_v] = settings_.wrap;
  const F8 x = wrapped(u, wrap_u) * to_float(level.width);
  const F8 y = (F8(1.0f) - wrapped(v, wrap_v)) * to_float(level.height);
  const F8 left = floor(x - F8(0.5f)), top = floor(y - F8(0.5f));
  const F8 fx = x - F8(0.5f) - left, fy = y - F8(0.5f) - top;
  const U8 x0 = wrapped_index(truncate(left), level.width, wrap_u);
  const U8 x1 = wrapped_index(truncate(left) + U8(1u), level.width, wrap_u);
  const U8 y0 = wrapped_index(truncate(top), level.height, wrap_v) * level.width + level.first;
  const U8 y1 = wrapped_index(truncate(top) + U8(1u), level.height, wrap_v) * level.width + level.first;
  const auto at = [&](U8 index) { return texel(texels, index, lanes); };
  const auto mix = [&](const Rgba8& a, const Rgba8& b, F8 t) {
    return Rgba8{a.rgb * (F8(1.0f) - t) + b.rgb * t, a.alpha * (F8(1.0f) - t) + b.alpha * t};
  };
  return mix(mix(at(y0 + x0), at(y0 + x1), fx), mix(at(y1 + x0), at(y1 + x1), fx), fy);
}

Texture::Slopes8 Texture::slopes_mapped(F8 u, F8 v, M8 lanes) const {
  struct Difference {
    Rgba8 value;
    F8 step;  ///< of the rounded coordinates
  };
  const auto difference = [&](F8 at, int texels, const auto& look) -> Difference {
    const F8 half(0.5f / static_cast<float>(texels)), low = at - half, high = at + half;
    const Rgba8 a = look(low), b = look(high);
    return {{b.rgb - a.rgb, b.alpha - a.alpha}, high - low};
  };
  const Difference by_x = difference(u, texels_->width, [&](F8 at) { return bilinear(at, v, lanes); });
  const Difference by_y = difference(v, texels_->height, [&](F8 at) { return bilinear(u, at, lanes); });
  const auto slope = [&](std::size_t axis) -> Rgba8 {
    const auto factor = [&](const Difference& by, float along) {
      return select(by.step > F8(0.0f), F8(along) / by.step, F8(0.0f));
    };
    const F8 x = factor(by_x, settings_.matrix[0][axis]), y = factor(by_y, settings_.matrix[1][axis]);
    return {by_x.value.rgb * x + by_y.value.rgb * y, by_x.value.alpha * x + by_y.value.alpha * y};
  };
  return {slope(0), slope(1)};
}

Vec3 Texture::mean() const {
  Vec3d sum(0);
  const std::size_t pixels = static_cast<std::size_t>(texels_->width) * static_cast<std::size_t>(texels_->height);
  const bool floats = !texels_->floats.empty();
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      sum[static_cast<int>(channel)] +=
          floats ? texels_->floats[4 * i + channel] : colors_[component(*texels_, i, channel)];
    }
  }
  return Vec3(sum / static_cast<double>(pixels));
}

std::uint64_t TextureSet::bytes() const {
  std::set<const Texels*> counted;
  std::uint64_t bytes = 0;
  const auto add = [&](const Texels& texels) { bytes += counted.insert(&texels).second ? size_bytes(texels) : 0; };
  for (const Texture& texture : textures_) {
    add(texture.texels());
    if (texture.pyramid() != nullptr) {
      add(texture.pyramid()->texels());
    }
  }
  return bytes;
}

Vec3 TextureSet::mean(std::uint32_t texture) const {
  const auto tiles = tiles_.find(texture);
  if (tiles == tiles_.end()) {
    return textures_[texture].mean();
  }
  Vec3 sum(0);
  for (const auto& [square, image] : tiles->second) {
    sum += textures_[image].mean();
  }
  return sum / static_cast<float>(tiles->second.size());
}

namespace {

/// Calls `visit(number, lanes)` for each of the numbers in the lanes that is not TextureSet::kNone.
template <class Visit>
void for_each_number(U8 numbers, M8 lanes, const Visit& visit) {
  M8 left = and_not(lanes, numbers == U8(TextureSet::kNone));
  alignas(32) std::uint32_t ids[8];
  numbers.store(ids);
  while (left.any()) {
    const std::uint32_t id = ids[std::countr_zero(static_cast<unsigned>(left.bits()))];
    const M8 same = left & (numbers == U8(id));
    visit(id, same);
    left = and_not(left, same);
  }
}

}  // namespace

template <class Visit>
void TextureSet::for_each_image(U8 texture, F8 u, F8 v, M8 lanes, const Visit& visit) const {
  for_each_number(texture, lanes, [&](std::uint32_t id, M8 same) {
    const auto [x, y] = textures_[id].mapped(u, v);
    const auto tiles = tiles_.empty() ? tiles_.end() : tiles_.find(id);
    if (tiles == tiles_.end()) [[likely]] {
      visit(textures_[id], x, y, same);
      return;
    }
    const F8 zero(0.0f), columns(static_cast<float>(kColumns)), rows(static_cast<float>(kRows));
    const F8 column = floor(x), row = floor(y), in_x = x - column, in_y = y - row;
    const M8 within = same & (column >= zero) & (column < columns) & (row >= zero) & (row < rows);
    for_each_number(truncate(row * columns + column), within, [&](std::uint32_t square, M8 there) {
      if (const auto image = tiles->second.find(square); image != tiles->second.end()) {
        visit(textures_[image->second], in_x, in_y, there);
      }
    });
  });
}

Texture::Rgba8 TextureSet::lookup(U8 texture, F8 u, F8 v, F8 footprint, M8 lanes) const {
  const F8 one = masked(texture == U8(kNone), F8(1.0f));
  Texture::Rgba8 result{{one, one, one}, one};
  for_each_image(texture, u, v, lanes, [&](const Texture& image, F8 x, F8 y, M8 same) {
    result = select(same, image.lookup_mapped(x, y, footprint, same), result);
  });
  return result;
}

Texture::Slopes8 TextureSet::slopes(U8 texture, F8 u, F8 v, M8 lanes) const {
  Texture::Slopes8 result;
  for_each_image(texture, u, v, lanes, [&](const Texture& image, F8 x, F8 y, M8 same) {
    const Texture::Slopes8 found = image.slopes_mapped(x, y, same);
    result = {select(same, found.u, result.u), select(same, found.v, result.v)};
  });
  return result;
}

}  // namespace lightmill
