// `path`: unidirectional path tracing with next-event estimation and multiple importance sampling.
//
// Breadth-first: a batch of camera rays is traced eight at a time, all hits of a bounce are shaded before the next
// bounce, and what is left is packed together, in order, so that Embree and the shading code always see full lanes.
// Sampling decisions are Sobol' pairs for the first vertices and hashed numbers after; Russian roulette is mild and,
// below sample 64, the light that the first surface scatters is followed along four paths (both are functions of the
// sample index alone).
#pragma once

#include <memory>

#include "common/methods/method.h"

namespace lightmill {

std::unique_ptr<Method> make_path_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings);

}  // namespace lightmill
