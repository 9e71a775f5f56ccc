// Mix of a reconstructed picture and the raw one: the raw picture counts more where the reconstruction is worse.
#pragma once

#include <vector>

#include "common/film/reconstruct.h"

namespace lightmill {

/// Replaces `picture`, the reconstruction of the film (planar R, G, B), by the mix t·picture + (1 − t)·mean. V is the
/// variance of the mean, and E the mean squared error of the reconstruction. If both errors are independent,
/// t = V / (V + E) has the least error, VE / (V + E). It is below V and below E. V comes from the halves, and V + E is
/// the mean of (picture − mean)², both over the pixels around, with relative weights. This is James and Stein's
/// estimator. Pixels without both halves, or with values that are not finite, stay as they are.
void mix_with_raw(const ReconstructionInput& film, float brightness, std::vector<float>& picture);

}  // namespace lightmill
