#include "common/materials/texel_values.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <memory>

namespace lightmill {
namespace {

constexpr std::size_t kWords = 65536, kBytes = 256;
constexpr std::size_t kHalfOfOne = 0x3c00;
constexpr int kCells = 4096;  // of [0, 1], a power of two

template <std::size_t kCount, class ValueOf>
std::unique_ptr<std::array<float, kCount>> tabulated(bool decode, const ValueOf& value_of) {
  auto table = std::make_unique<std::array<float, kCount>>();
  for (std::size_t i = 0; i < kCount; ++i) {
    const double value = value_of(i);
    (*table)[i] = static_cast<float>(decode ? srgb_decode_fixed(value > 0 ? std::min(value, 1.0) : 0) : value);
  }
  return table;
}

template <std::size_t kCount>
std::span<const float> of_integers(bool decode) {
  const auto value_of = [](std::size_t i) { return static_cast<double>(i) / (kCount - 1); };
  static const auto linear = tabulated<kCount>(false, value_of), decoded = tabulated<kCount>(true, value_of);
  return decode ? *decoded : *linear;
}

std::span<const float> of_halves(bool decode) {
  const auto value_of = [](std::size_t i) { return _cvtsh_ss(static_cast<std::uint16_t>(i)); };
  static const auto linear = tabulated<kWords>(false, value_of), decoded = tabulated<kWords>(true, value_of);
  return decode ? *decoded : *linear;
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

std::span<const float> texel_values(const Texels& texels, bool decode) {
  if (!texels.bytes.empty()) {
    return of_integers<kBytes>(decode);
  }
  return texels.half ? of_halves(decode) : of_integers<kWords>(decode);
}

TexelEncoder::TexelEncoder(const Texels& texels, bool decode)
    : rounds_half_(texels.half && !decode), values_(texel_values(texels, decode)) {
  if (texels.half) {
    values_ = values_.first(kHalfOfOne + 1);
  }
  for (int cell = 0; cell <= kCells && !rounds_half_; ++cell) {
    const auto above = std::ranges::lower_bound(values_, static_cast<float>(cell) / kCells);
    first_.push_back(static_cast<std::uint32_t>(above - values_.begin()));
  }
}

std::uint32_t TexelEncoder::operator()(float value) const {
  if (rounds_half_) {
    return _cvtss_sh(value, _MM_FROUND_TO_NEAREST_INT);
  }
  value = std::min(std::max(value, 0.0f), 1.0f);
  const auto cell = std::min(static_cast<std::size_t>(value * kCells), std::size_t{kCells} - 1);
  const auto begin = values_.begin();
  const auto above = std::lower_bound(begin + first_[cell], begin + first_[cell + 1], value);
  const bool below = above != begin && value - *(above - 1) < *above - value;
  return static_cast<std::uint32_t>(above - begin) - (below ? 1 : 0);
}

Texels decode_floats(const Texels& texels) {
  std::vector<float> linear(texels.floats.begin(), texels.floats.end());
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const bool alpha = i % 4 == 3;
    linear[i] = alpha ? linear[i] : static_cast<float>(srgb_decode_fixed(std::clamp(linear[i], 0.0f, 1.0f)));
  }
  return {texels.width, texels.height, {}, std::move(linear), false};
}

}  // namespace lightmill
