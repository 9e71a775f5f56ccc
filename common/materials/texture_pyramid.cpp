#include "common/materials/texture_pyramid.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>

#include "common/materials/texel_values.h"

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
  std::size_t first = 0, count = 0;
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
      cover.count = cover.share[j] > 0 ? j + 1 : cover.count;
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
      color_[channel] += weight * std::min(std::max(texel[channel], 0.0f), 1.0f);
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
    for (std::size_t j = 0; j < down.count; ++j) {
      from[j] = row(down.first + j);
    }
    for (const Cover& across : columns) {
      Mean mean(weight);
      for (std::size_t j = 0; j < down.count; ++j) {
        for (std::size_t i = 0; i < across.count; ++i) {
          mean.add(from[j] + 4 * (across.first + i), down.share[j] * across.share[i]);
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
Level reduce(const Texels& image, bool decode, TexturePyramid::Weight weight) {
  const auto width = static_cast<std::size_t>(image.width);
  if (!image.floats.empty()) {
    return reduce(image.width, image.height, weight, [&](std::size_t y) { return &image.floats[4 * y * width]; });
  }
  const std::span<const float> colors = texel_values(image, decode), alphas = texel_values(image, false);
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::array<std::vector<float>, 3> rows{};
  rows.fill(std::vector<float>(4 * width));
  std::array<std::size_t, 3> held{kNone, kNone, kNone};
  return reduce(image.width, image.height, weight, [&](std::size_t y) -> const float* {
    std::vector<float>& row = rows[y % 3];
    if (held[y % 3] != y) {
      held[y % 3] = y;
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t pixel = y * width + x;
        for (std::size_t channel = 0; channel < 3; ++channel) {
          row[4 * x + channel] = colors[component(image, pixel, channel)];
        }
        row[4 * x + 3] = alphas[component(image, pixel, 3)];
      }
    }
    return row.data();
  });
}

/// Levels in the format of an image.
class Encoded {
 public:
  Encoded(const Texels& image, bool decode, std::size_t texels)
      : image_(image), bytes_(image.bytes.empty() ? 0 : texels), words_(image.words.empty() ? 0 : texels) {
    floats_.reserve(image.floats.empty() ? 0 : 4 * texels);
    if (image.floats.empty()) {
      color_.emplace(image, decode);
      alpha_.emplace(image, false);
    }
  }

  void append(const Level& level) {
    if (!color_) {
      floats_.insert(floats_.end(), level.values.begin(), level.values.end());
      return;
    }
    for (std::size_t i = 0; i < level.values.size(); i += 4, ++size_) {
      const float* const v = &level.values[i];
      const std::uint64_t r = (*color_)(v[0]), g = (*color_)(v[1]), b = (*color_)(v[2]), a = (*alpha_)(v[3]);
      if (words_.empty()) {
        bytes_[size_] = static_cast<std::uint32_t>(r | g << 8 | b << 16 | a << 24);
      } else {
        words_[size_] = r | g << 16 | b << 32 | a << 48;
      }
    }
  }
  Texels texels() && {
    const auto width = static_cast<int>(color_ ? size_ : floats_.size() / 4);
    return {width, 1, std::move(bytes_), std::move(floats_), image_.encoded, std::move(words_), image_.half};
  }

 private:
  const Texels& image_;
  std::optional<TexelEncoder> color_, alpha_;  ///< none for floats
  std::vector<std::uint32_t> bytes_;
  std::vector<std::uint64_t> words_;
  std::vector<float> floats_;
  std::size_t size_ = 0;  ///< texels so far
};

/// Calls `visit(width, height)` for each level.
template <class Visit>
void for_each_level(int width, int height, const Visit& visit) {
  while (width > 1 || height > 1) {
    width = halved(width);
    height = halved(height);
    visit(width, height);
  }
}

}  // namespace

TexturePyramid::TexturePyramid(const Texels& image, bool decode, Weight weight) {
  std::size_t total = 0;
  for_each_level(image.width, image.height, [&](int width, int height) {
    width_.push_back(static_cast<std::uint32_t>(width));
    height_.push_back(static_cast<std::uint32_t>(height));
    first_.push_back(static_cast<std::uint32_t>(total));
    total += count(width, height);
  });
  Encoded encoded(image, decode, total);
  Level level;
  for (std::uint32_t i = 0; i < levels(); ++i) {
    level = i == 0 ? reduce(image, decode, weight) : reduce(level, weight);
    encoded.append(level);
  }
  texels_ = std::move(encoded).texels();
}

std::uint64_t pyramid_bytes(int width, int height, std::uint32_t bytes_per_pixel) {
  std::uint64_t texels = 0;
  for_each_level(width, height, [&](int wide, int high) { texels += count(wide, high); });
  return texels * bytes_per_pixel;
}

std::uint64_t pyramid_peak_bytes(int width, int height, std::uint32_t bytes_per_pixel) {
  constexpr std::uint64_t kFloats = 16;
  const int wide = halved(width), high = halved(height);
  return pyramid_bytes(width, height, bytes_per_pixel) +
         (count(wide, high) + count(halved(wide), halved(high))) * kFloats;
}

}  // namespace lightmill
