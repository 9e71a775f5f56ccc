#include "common/scene_io/obj_colors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/materials/texel_values.h"
#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

constexpr std::array<float, 3> kNoColor{-1, -1, -1};  ///< of a vertex that has none

}  // namespace

void ObjColors::read(std::size_t vertex, std::string_view rest) {
  std::array<float, 4> values{};
  std::size_t count = 0;
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
    const std::optional<double> value = parse_number(word);
    if (!value || count == values.size()) {
      return;
    }
    values[count++] = static_cast<float>(*value);
  }
  if (count < 3) {
    return;
  }
  colors_.resize(vertex, kNoColor);
  colors_.push_back({values[0], values[1], values[2]});
  has_alpha_ = has_alpha_ || (count == 4 && values[3] < 1);
}

std::vector<std::array<float, 3>> ObjColors::take_linear(std::string_view file_name,
                                                         std::vector<std::string>& notices) {
  bool bytes = false, whole = true;
  for (const auto& color : colors_) {
    for (const float value : color) {
      bytes = bytes || value > 1.001f;
      whole = whole && value == std::floor(value);
    }
  }
  if (bytes && !whole) {
    notices.push_back(fmt::format("vertex colours of {} that are above 1 were cut", file_name));
  }
  const double unit = bytes && whole ? 255 : 1;
  for (auto& color : colors_) {
    if (color == kNoColor) {
      color = {1, 1, 1};
      continue;
    }
    for (float& value : color) {
      value = static_cast<float>(srgb_decode_fixed(std::clamp(value / unit, 0.0, 1.0)));
    }
  }
  if (has_alpha_) {
    notices.push_back(fmt::format("left out: alpha of vertex colours of {}", file_name));
  }
  return std::move(colors_);
}

}  // namespace lightmill
