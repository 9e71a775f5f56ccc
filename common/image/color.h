// Conversion of linear colour to displayed colour: sRGB transfer function, exposure, and view transforms of PNG files.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill {

/// The sRGB transfer function (IEC 61966-2-1), linear to encoded, exact. Clamps to [0, 1]. NaN gives 0.
float srgb_encode(float linear);
/// Its inverse on [0, 1].
float srgb_decode(float encoded);

/// View transform from linear radiance to displayed values.
enum class View {
  plain,   ///< clipped at 1
  filmic,  ///< filmic_curve: highlights roll off
};

/// "plain" or "filmic".
Result<View> parse_view(std::string_view name);

/// The filmic curve x(2.51x + 0.03) / (x(2.43x + 0.59) + 0.14), clamped to [0, 1], per channel: K. Narkowicz's fit of
/// the ACES reference tone curve ("ACES Filmic Tone Mapping Curve", 2015).
float filmic_curve(float linear);

inline constexpr double kMaxGamma = 10;

struct ViewSettings {
  double exposure_stops = 0;  ///< values are first multiplied by 2^stops
  View view = View::plain;
  double gamma = 1;  ///< values are raised to 1/gamma before the sRGB curve; in (0, kMaxGamma]
};

/// 8-bit sRGB, interleaved RGB, rows from the top. No dither, so equal pixels give equal bytes.
std::vector<std::uint8_t> to_srgb8(const RgbImage& image, const ViewSettings& settings);

}  // namespace lightmill
