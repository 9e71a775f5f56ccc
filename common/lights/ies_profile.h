// IES LM-63 files (measured luminaires) as plain values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

inline constexpr std::size_t kMaxIesAngles = 4096;                  ///< of each kind, in a file
inline constexpr std::size_t kMaxIesValues = std::size_t{1} << 22;  ///< of a profile, with its symmetries
inline constexpr std::uint64_t kMaxIesBytes = 64ull << 20;          ///< of a file

/// Intensity distribution of a luminaire of photometric type C. Symmetries of the file are expanded. Its multiplier and
/// ballast factors are applied.
struct IesProfile {
  std::vector<double> vertical;           ///< degrees from the axis (nadir), ascending in [0, 180]; at least 2
  std::vector<double> horizontal;         ///< degrees about the axis, ascending from 0 to 360
  std::vector<double> candela;            ///< [horizontal][vertical]
  std::vector<std::string> notices = {};  ///< where the profile differs from the file

  /// Intensity at two angles in degrees: bilinear between the given angles, zero below the first and above the last
  /// vertical angle.
  double at(double vertical_degrees, double horizontal_degrees) const;
  /// Luminous flux: the integral of `at` over the sphere, in lm.
  double lumen() const;
};

/// Reads LM-63 of 1986, 1991, 1995, 2002 or 2019. Errors name file and line: "lamp.ies:12: …". Factors for tilted
/// mounting (TILT=INCLUDE or a file) are skipped, so the luminaire shines as it was measured. A circle without its last
/// angle is closed.
Result<IesProfile> read_ies(std::string_view text, std::string_view file);

}  // namespace lightmill
