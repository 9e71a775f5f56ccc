// `photon-dots`: the photon map as points on the film.
//
// One pass of photons, the same in every sample, so that the picture stays as it is however many samples it has. Each
// place where a photon was deposited and that the eye sees directly is a dot of one pixel, of the photon's colour; it
// is as bright as the photon's power against the mean of all as they leave their lights, so that a white one that has
// lost nothing is 1. Dots in one pixel add up; what a pixel's filter covers beside it counts as chance has it. Nothing
// else is shown: no lamps, and nothing in or through mirrors and glass.
#pragma once

#include <memory>

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {

/// All deposits of `ppm`, or with spec.caustic those of `caustic`. The scene's media must not scatter.
std::unique_ptr<Method> make_photon_dots_method(std::shared_ptr<const CompiledScene> scene,
                                                const MethodSettings& settings, const MethodSpec& spec);

}  // namespace lightmill
