// Header of a Radiance picture (.hdr): order and meaning of its pixels. OpenImageIO reads only the size and the pixels.
#pragma once

#include <array>
#include <optional>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/primaries.h"

namespace lightmill {

/// G. Ward, "The RADIANCE Picture File Format".
struct RadianceHeader {
  std::size_t end = 0;                      ///< where the pixels begin
  int scanlines = 0;                        ///< in the order of the file
  int length = 0;                           ///< pixels of a scanline
  bool columns = false;                     ///< a scanline is a column of the picture
  bool upwards = false;                     ///< the bottom comes first
  bool leftwards = false;                   ///< the right side comes first
  std::array<double, 3> exposure{1, 1, 1};  ///< pixels were multiplied by it: all EXPOSURE and COLORCORR together
  bool xyz = false;                         ///< pixels are CIE XYZ values
  std::optional<Primaries> primaries;       ///< of other pixels; nothing: Rec. 709

  int width() const { return columns ? scanlines : length; }
  int height() const { return columns ? length : scanlines; }
  /// Number of the pixel in the file that is at (x, y) of the picture.
  std::size_t pixel_at(int x, int y) const;
  /// The shortest header before the same scanlines, which has neither orientation nor exposure.
  std::string plain() const;
};

/// INVALID_ARGUMENT, naming the line, if it cannot be read, or if the pixels are not linear.
Result<RadianceHeader> read_radiance_header(ByteView bytes);

}  // namespace lightmill
