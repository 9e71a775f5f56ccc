// What an image must keep to in order to be used by a scene, beyond what decoding asks
// (image/decoder/decoder_process.h).
#pragma once

#include "common/base/status.h"

namespace lightmill {

/// Pixels. An environment's texels are found by single-precision coordinates, which know this many columns with places
/// between them.
inline constexpr int kMaxEnvironmentSide = 65'536;

inline Status check_environment_size(int width, int height) {
  return std::max(width, height) <= kMaxEnvironmentSide
             ? ok_status()
             : invalid_argument("an environment may have at most {} pixels on a side, got {}x{}", kMaxEnvironmentSide,
                                width, height);
}

}  // namespace lightmill
