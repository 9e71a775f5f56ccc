#include "common/materials/texture.h"

#include <cmath>
#include <set>
#include <tuple>

#include "common/base/check.h"

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
U8 wrapped_index(U8 index, std::uint32_t size, TextureWrap wrap) {
  const M8 below = signed_less(index, U8(0u));
  const M8 above = ~signed_less(index, U8(size));
  const bool repeat = wrap == TextureWrap::repeat;
  return select(below, U8(repeat ? size - 1 : 0), select(above, U8(repeat ? 0 : size - 1), index));
}

}  // namespace

double srgb_decode_fixed(double encoded) {
  if (encoded <= 0.04045) {
    return encoded / 12.92;
  }
  // x^2.4 = x² · (x²)^(1/5). Newton's method from above finds the root with exactly rounded operations only.
  const double x = (encoded + 0.055) / 1.055;
  const double square = x * x;
  double root = 1;
  for (int i = 0; i < 40; ++i) {
    const double fourth = root * root * root * root;
    root = (4 * root + square / fourth) / 5;
  }
  return square * root;
}

Texels decode_floats(const Texels& texels) {
  std::vector<float> linear(texels.floats.begin(), texels.floats.end());
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const bool alpha = i % 4 == 3;
    linear[i] = alpha ? linear[i] : static_cast<float>(srgb_decode_fixed(std::clamp(linear[i], 0.0f, 1.0f)));
  }
  return {texels.width, texels.height, {}, std::move(linear), false};
}

Texture::Texture(std::shared_ptr<const Texels> texels, const TextureSettings& settings)
    : texels_(std::move(texels)), settings_(settings) {
  LM_CHECK(texels_->width > 0 && texels_->height > 0);
  for (int i = 0; i < 256; ++i) {
    const double value = i / 255.0;
    decoded_[static_cast<std::size_t>(i)] = static_cast<float>(settings_.decode ? srgb_decode_fixed(value) : value);
  }
}

Texture::Rgba8 Texture::texel(U8 x, U8 y, M8 lanes) const {
  const U8 index = y * U8(static_cast<std::uint32_t>(texels_->width)) + x;
  if (!texels_->bytes.empty()) {
    const U8 packed = gather(texels_->bytes.data(), index, lanes);
    const U8 low(0xffu);
    return {{gather(decoded_.data(), packed & low, lanes), gather(decoded_.data(), (packed >> 8) & low, lanes),
             gather(decoded_.data(), (packed >> 16) & low, lanes)},
            to_float(packed >> 24) * F8(1.0f / 255)};
  }
  const U8 first = index << 2;
  const float* base = texels_->floats.data();
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

Texture::Rgba8 Texture::lookup(F8 u, F8 v, M8 lanes) const {
  std::tie(u, v) = mapped(u, v);
  return settings_.filter == TextureFilter::nearest ? nearest(u, v, lanes) : bilinear(u, v, lanes);
}

/// u = 1 belongs to the last column, v = 1 to the top row, v = 0 to the bottom row.
Texture::Rgba8 Texture::nearest(F8 u, F8 v, M8 lanes) const {
  const auto width = static_cast<std::uint32_t>(texels_->width);
  const auto height = static_cast<std::uint32_t>(texels_->height);
  const F8 x = wrapped(u, settings_.wrap[0]) * F8(static_cast<float>(width));
  const F8 y = wrapped(v, settings_.wrap[1]) * F8(static_cast<float>(height));
  const F8 column = min(floor(x), F8(static_cast<float>(width - 1)));
  const F8 from_below = min(floor(y), F8(static_cast<float>(height - 1)));
  return texel(truncate(column), U8(height - 1) - truncate(from_below), lanes);
}

Texture::Rgba8 Texture::bilinear(F8 u, F8 v, M8 lanes) const {
  const auto width = static_cast<std::uint32_t>(texels_->width);
  const auto height = static_cast<std::uint32_t>(texels_->height);
  const auto [wrap_u, wrap_v] = settings_.wrap;
  const F8 x = wrapped(u, wrap_u) * F8(static_cast<float>(width));
  const F8 y = (F8(1.0f) - wrapped(v, wrap_v)) * F8(static_cast<float>(height));
  const F8 left = floor(x - F8(0.5f)), top = floor(y - F8(0.5f));
  const F8 fx = x - F8(0.5f) - left, fy = y - F8(0.5f) - top;
  const U8 x0 = wrapped_index(truncate(left), width, wrap_u), y0 = wrapped_index(truncate(top), height, wrap_v);
  const U8 x1 = wrapped_index(truncate(left) + U8(1u), width, wrap_u);
  const U8 y1 = wrapped_index(truncate(top) + U8(1u), height, wrap_v);
  const auto mix = [&](const Rgba8& a, const Rgba8& b, F8 t) {
    return Rgba8{a.rgb * (F8(1.0f) - t) + b.rgb * t, a.alpha * (F8(1.0f) - t) + b.alpha * t};
  };
  return mix(mix(texel(x0, y0, lanes), texel(x1, y0, lanes), fx), mix(texel(x0, y1, lanes), texel(x1, y1, lanes), fx),
             fy);
}

Texture::Slopes8 Texture::slopes(F8 u, F8 v, M8 lanes) const {
  std::tie(u, v) = mapped(u, v);
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
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!texels_->bytes.empty()) {
      const std::uint32_t packed = texels_->bytes[i];
      sum += Vec3d(decoded_[packed & 255], decoded_[packed >> 8 & 255], decoded_[packed >> 16 & 255]);
    } else {
      sum += Vec3d(texels_->floats[4 * i], texels_->floats[4 * i + 1], texels_->floats[4 * i + 2]);
    }
  }
  return Vec3(sum / static_cast<double>(pixels));
}

std::uint64_t TextureSet::bytes() const {
  std::set<const Texels*> counted;
  std::uint64_t bytes = 0;
  for (const Texture& texture : textures_) {
    if (counted.insert(&texture.texels()).second) {
      bytes += size_bytes(texture.texels());
    }
  }
  return bytes;
}

template <class Visit>
void TextureSet::for_each(U8 texture, M8 lanes, const Visit& visit) const {
  M8 left = and_not(lanes, texture == U8(kNone));
  alignas(32) std::uint32_t ids[8];
  texture.store(ids);
  while (left.any()) {
    const std::uint32_t id = ids[std::countr_zero(static_cast<unsigned>(left.bits()))];
    const M8 same = left & (texture == U8(id));
    visit(textures_[id], same);
    left = and_not(left, same);
  }
}

namespace {

Texture::Rgba8 select(M8 mask, const Texture::Rgba8& yes, const Texture::Rgba8& no) {
  return {select(mask, yes.rgb, no.rgb), select(mask, yes.alpha, no.alpha)};
}

}  // namespace

Texture::Rgba8 TextureSet::lookup(U8 texture, F8 u, F8 v, M8 lanes) const {
  Texture::Rgba8 result{{F8(1.0f), F8(1.0f), F8(1.0f)}, F8(1.0f)};
  for_each(texture, lanes,
           [&](const Texture& image, M8 same) { result = select(same, image.lookup(u, v, same), result); });
  return result;
}

Texture::Slopes8 TextureSet::slopes(U8 texture, F8 u, F8 v, M8 lanes) const {
  Texture::Slopes8 result;
  for_each(texture, lanes, [&](const Texture& image, M8 same) {
    const Texture::Slopes8 found = image.slopes(u, v, same);
    result = {select(same, found.u, result.u), select(same, found.v, result.v)};
  });
  return result;
}

}  // namespace lightmill
