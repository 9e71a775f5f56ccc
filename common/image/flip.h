// FLIP: the visible difference between two pictures that are shown in alternation.
//
// LDR-FLIP: P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. HDR-FLIP: P. Andersson, J.
// Nilsson, P. Shirley, T. Akenine-Möller, "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics
// Short Papers, 2021.
#pragma once

#include <vector>

#include "common/base/status.h"
#include "common/image/image.h"

namespace lightmill {

/// Pixels per degree of visual angle of the papers' observer: 0.7 m from a screen that is 0.7 m and 3840 pixels wide.
inline constexpr double kFlipPixelsPerDegree = 67.02064327658225;

/// LDR-FLIP error of every pixel, in [0, 1]. Linear RGB values are clamped to [0, 1]. INVALID_ARGUMENT if the sizes
/// differ or a value is not finite.
Result<std::vector<float>> flip_map(const RgbImage& picture, const RgbImage& reference,
                                    double pixels_per_degree = kFlipPixelsPerDegree);

/// HDR-FLIP error: the largest error of every pixel over exposures with the ACES tone curve. The exposures reach from
/// the one for the reference's brightest pixel to the one for its median. Negative values count as 0. If the median is
/// 0, the median of the nonzero pixels is used. A black reference has only the exposure 1.
Result<std::vector<float>> hdr_flip_map(const RgbImage& picture, const RgbImage& reference,
                                        double pixels_per_degree = kFlipPixelsPerDegree);

/// The mean of a map, which is the usual single number.
double mean_flip(const std::vector<float>& map);

}  // namespace lightmill
