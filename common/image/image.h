// Image in memory, as read from and written to EXR files: named planar channels over a window of a frame, and
// attributes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/image/primaries.h"

namespace lightmill {

/// A rectangle of pixels. x points right, y down.
struct ImageWindow {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  std::int64_t pixel_count() const { return std::int64_t{width} * height; }
  friend bool operator==(const ImageWindow&, const ImageWindow&) = default;
};

/// One value per pixel of the data window, row by row from the top.
struct ImageChannel {
  std::string name;
  std::variant<std::vector<float>, std::vector<std::uint32_t>> values;
};

using ImageMatrix = std::array<float, 16>;  ///< 4×4, row by row
using ImageAttribute = std::variant<std::string, int, float, double, ImageMatrix>;

struct Image {
  ImageWindow display;  ///< the full frame
  ImageWindow data;     ///< the part of it that has pixels
  std::vector<ImageChannel> channels;
  std::map<std::string, ImageAttribute> attributes;
  std::optional<Primaries> primaries = {};  ///< as an EXR states them. Encoding ignores them

  /// The values of a float channel; null if there is none of this name.
  const std::vector<float>* floats(const std::string& name) const;
  /// The values of an integer channel; null if there is none of this name.
  const std::vector<std::uint32_t>* counts(const std::string& name) const;
  /// A text attribute; empty if there is none of this name.
  std::string text(const std::string& name) const;
};

/// Linear RGB, planar: `values[channel * pixels + pixel]`, rows from the top.
struct RgbImage {
  int width = 0;
  int height = 0;
  std::vector<float> values;
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

}  // namespace lightmill
