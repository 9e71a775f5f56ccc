#include "common/materials/texture_pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightmill {
namespace {

int halved(int size) {
  return (size + 1) / 2;
}

std::size_t count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// Linear colours and alpha, four per texel, in rows from the top.
struct Level {
  int width = 0, height = 0;
  std::vector<float> values;
};

/// Texels of a row of `from` texels that one of `to` texels covers, with their shares of its length.
struct Cover {
  std::size_t first = 0;
  std::array<float, 3> share{};  ///< one texel has at most two texels' length
};
std::vector<Cover> covers(int from, int to) {
  std::vector<Cover> out(static_cast<std::size_t>(to));
  for (int i = 0; i < to; ++i) {
    const double length = static_cast<double>(from) / to, begin = i * length, end = (i + 1) * length;
    Cover& cover = out[static_cast<std::size_t>(i)];
    cover.first = static_cast<std::size_t>(begin);
    for (std::size_t j = 0; j < cover.share.size(); ++j) {
      const auto left = static_cast<double>(cover.first + j);
      cover.share[j] = static_cast<float>(std::max(0.0, std::min(end, left + 1) - std::max(begin, left)) / length);
    }
  }
  return out;
}

/// Adds up texels. Colours have their own weights.
class Mean {
 public:
  explicit Mean(TexturePyramid::Weight weight) : by_alpha_(weight == TexturePyramid::Weight::alpha) {}

  void add(const float* texel, float share) {
    // Where all is transparent, the colours still have their mean.
    const float weight = by_alpha_ ? share * std::max(texel[3], 0x1p-20f) : share;
    for (int channel = 0; channel < 3; ++channel) {
      color_[channel] += weight * texel[channel];
    }
    alpha_ += share * texel[3];
    area_ += share;
    total_ += weight;
  }
  void store(float* texel) const {
    for (int channel = 0; channel < 3; ++channel) {
      texel[channel] = color_[channel] / total_;
    }
    texel[3] = alpha_ / area_;
  }

 private:
  bool by_alpha_;
  float color_[3] = {0, 0, 0};
  float alpha_ = 0, area_ = 0, total_ = 0;
};

/// `row(y)` points to the linear values of a row. Three rows must be valid together.
template <class Row>
Level reduce(int width, int height, TexturePyramid::Weight weight, const Row& row) {
  Level out{halved(width), halved(height), {}};
  out.values.resize(4 * count(out.width, out.height));
  const std::vector<Cover> columns = covers(width, out.width), rows = covers(height, out.height);
  float* to = out.values.data();
  for (const Cover& down : rows) {
    std::array<const float*, 3> from{};
    for (std::size_t j = 0; j < 3; ++j) {
      from[j] = down.share[j] > 0 ? row(down.first + j) : nullptr;
    }
    for (const Cover& across : columns) {
      Mean mean(weight);
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t i = 0; i < 3; ++i) {
          if (const float share = down.share[j] * across.share[i]; share > 0) {
            mean.add(from[j] + 4 * (across.first + i), share);
          }
        }
      }
      mean.store(to);
      to += 4;
    }
  }
  return out;
}

Level reduce(const Level& level, TexturePyramid::Weight weight) {
  const std::size_t stride = 4 * static_cast<std::size_t>(level.width);
  return reduce(level.width, level.height, weight, [&](std::size_t y) { return level.values.data() + y * stride; });
}

/// The first level. Decodes the image three rows at a time.
Level reduce(const Texels& image, const std::array<float, 256>& decoded, TexturePyramid::Weight weight) {
  const std::size_t width = static_cast<std::size_t>(image.width);
  if (image.bytes.empty()) {
    return reduce(image.width, image.height, weight, [&](std::size_t y) { return &image.floats[4 * y * width]; });
  }
  std::array<std::vector<float>, 3> rows{};
  rows.fill(std::vector<float>(4 * width));
  std::array<std::size_t, 3> held{image.bytes.size(), image.bytes.size(), image.bytes.size()};
  return reduce(image.width, image.height, weight, [&](std::size_t y) -> const float* {
    std::vector<float>& row = rows[y % 3];
    if (held[y % 3] != y) {
      held[y % 3] = y;
      for (std::size_t x = 0; x < width; ++x) {
        const std::uint32_t packed = image.bytes[y * width + x];
        row[4 * x] = decoded[packed & 255];
        row[4 * x + 1] = decoded[packed >> 8 & 255];
        row[4 * x + 2] = decoded[packed >> 16 & 255];
        row[4 * x + 3] = static_cast<float>(packed >> 24) * (1.0f / 255);
      }
    }
    return row.data();
  });
}

/// The byte whose linear colour is nearest.
class Encoder {
 public:
  explicit Encoder(const std::array<float, 256>& decoded) {
    for (std::size_t i = 0; i + 1 < decoded.size(); ++i) {
      middle_[i] = 0.5f * (decoded[i] + decoded[i + 1]);
    }
  }
  std::uint32_t operator()(float linear) const {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(middle_, linear) - middle_.begin());
  }

 private:
  std::array<float, 255> middle_{};
};

void append(const Level& level, const Encoder& encode, std::vector<std::uint32_t>& bytes) {
  for (std::size_t i = 0; i < level.values.size(); i += 4) {
    const float* const v = &level.values[i];
    const auto alpha = static_cast<std::uint32_t>(v[3] * 255 + 0.5f);
    bytes.push_back(encode(v[0]) | encode(v[1]) << 8 | encode(v[2]) << 16 | alpha << 24);
  }
}

/// Calls `visit(width, height)` for each level.
template <class Visit>
void for_each_level(const Texels& image, const Visit& visit) {
  for (int width = image.width, height = image.height; width > 1 || height > 1;) {
    width = halved(width);
    height = halved(height);
    visit(width, height);
  }
}

}  // namespace

TexturePyramid::TexturePyramid(const Texels& image, const std::array<float, 256>& decoded, Weight weight) {
  std::size_t total = 0;
  for_each_level(image, [&](int width, int height) {
    width_.push_back(static_cast<std::uint32_t>(width));
    height_.push_back(static_cast<std::uint32_t>(height));
    first_.push_back(static_cast<std::uint32_t>(total));
    total += count(width, height);
  });
  const bool has_bytes = !image.bytes.empty();
  const Encoder encode(decoded);
  std::vector<std::uint32_t> bytes;
  std::vector<float> floats;
  bytes.reserve(has_bytes ? total : 0);
  floats.reserve(has_bytes ? 0 : 4 * total);
  Level level;
  for (std::uint32_t i = 0; i < levels(); ++i) {
    level = i == 0 ? reduce(image, decoded, weight) : reduce(level, weight);
    if (has_bytes) {
      append(level, encode, bytes);
    } else {
      floats.insert(floats.end(), level.values.begin(), level.values.end());
    }
  }
  texels_ = {static_cast<int>(total), 1, std::move(bytes), std::move(floats), image.encoded};
}

std::uint64_t pyramid_bytes(const Texels& image) {
  std::uint64_t texels = 0;
  for_each_level(image, [&](int width, int height) { texels += count(width, height); });
  return texels * (image.bytes.empty() ? 16 : 4);
}

}  // namespace lightmill
