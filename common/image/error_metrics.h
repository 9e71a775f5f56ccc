// Error metrics between two pictures.
#pragma once

#include <array>

#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill {

struct PictureError {
  double rel_mse = 0;                        ///< mean over pixels and channels of (x−r)² / (r² + 0.01)
  double rel_mse_trimmed = 0;                ///< the same without the worst 0.1 % of the pixels (rounded down)
  double energy_ratio = 0;                   ///< Σx / Σr; 1 if both are zero, infinite if only Σr is
  std::array<double, 3> energy_ratio_rgb{};  ///< the same of each channel
  double smape = 0;                          ///< mean of |x−r| / (|x|+|r|), in [0, 1]; 0/0 counts as 0
  double max_abs = 0;                        ///< largest |x−r|
};

/// INVALID_ARGUMENT unless both pictures have the same size and only finite values.
Status check_comparable(const RgbImage& picture, const RgbImage& reference);

/// Compares linear RGB pictures of the same size. INVALID_ARGUMENT as for check_comparable.
Result<PictureError> compare_pictures(const RgbImage& picture, const RgbImage& reference);

}  // namespace lightmill
