// FLIP: how different two pictures look to a person who flips between them.
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

/// Pixels per degree of visual angle for the papers' observer: 0.7 m before a screen 0.7 m and 3840 pixels wide.
inline constexpr double kFlipPixelsPerDegree = 67.02064327658225;

/// The error of every pixel, in [0, 1], of linear RGB pictures that are shown as they are: values are clamped to
/// [0, 1]. INVALID_ARGUMENT if the sizes differ or a value is not finite.
Result<std::vector<float>> flip_map(const RgbImage& picture, const RgbImage& reference,
                                    double pixels_per_degree = kFlipPixelsPerDegree);

/// The largest error of every pixel over exposures and the ACES tone curve, from the one that shows the brightest pixel
/// of the reference to the one that shows its median. Negative values count as 0. Where the median is 0 that of the
/// pixels that are not is taken; a black reference has the exposure 1 alone.
Result<std::vector<float>> hdr_flip_map(const RgbImage& picture, const RgbImage& reference,
                                        double pixels_per_degree = kFlipPixelsPerDegree);

/// The mean of a map: the number that is usually stated.
double mean_flip(const std::vector<float>& map);

}  // namespace lightmill
