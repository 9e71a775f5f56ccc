// Measured luminaires: IES LM-63 files, as values.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

inline constexpr std::size_t kMaxIesAngles = 4096;                  ///< of each kind, in a file
inline constexpr std::size_t kMaxIesValues = std::size_t{1} << 22;  ///< of a profile, with its symmetries
inline constexpr std::uint64_t kMaxIesBytes = 64ull << 20;          ///< of a file

/// The intensity distribution of a luminaire of photometric type C: what the file says, its symmetries made explicit,
/// its multiplier and ballast factors applied.
struct IesProfile {
  std::vector<double> vertical;    ///< degrees off the axis (nadir), ascending within [0, 180]; at least 2
  std::vector<double> horizontal;  ///< degrees about the axis, ascending from 0 to 360
  std::vector<double> candela;     ///< [horizontal][vertical]
  bool tilted = false;             ///< the file has factors for tilted mounting, which are not applied

  /// Intensity at two angles in degrees: bilinear between the angles given, zero above the last vertical angle and
  /// below the first.
  double at(double vertical_degrees, double horizontal_degrees) const;
  /// Luminous flux: the integral of `at` over the sphere, in lm.
  double lumen() const;
};

/// Reads LM-63 of 1986, 1991, 1995, 2002 or 2019. Errors name file and line: "lamp.ies:12: …". The factors for tilted
/// mounting (TILT=INCLUDE or a file) are read over: the lamp burns as it was measured.
Result<IesProfile> read_ies(std::string_view text, std::string_view file);

}  // namespace lightmill
