// The fixed parts of a report's page: CSS, script and pictures. Other reports may use them.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill::lab {

/// "data:image/png;base64,…".
std::string png_data_uri(std::string_view png);

/// CSS of the page, light and dark, with that of charts.
std::string page_css();

/// The script of the page. A click enlarges all pictures of a section around the same point. A checkbox shows the
/// differences.
std::string page_script();

/// A PNG of the difference (x − r)/(|r| + 0.1) of the channels' means: red where the picture is too bright, blue where
/// it is too dark, black where equal. A difference of 0.25 or more has full colour. The pictures have the same size.
Result<std::string> difference_png(const RgbImage& picture, const RgbImage& reference);

/// The picture itself as a PNG.
Result<std::string> picture_png(const RgbImage& picture);

}  // namespace lightmill::lab
