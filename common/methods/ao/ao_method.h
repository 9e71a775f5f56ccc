// `ao`, ambient occlusion: how much of the sky each surface sees, whatever it is made of.
//
// The value is the mean over the hemisphere, weighted by the cosine, of 1 where nothing is within the distance that was
// asked for, else 0: what a white diffuse surface reflects of a constant sky of radiance 1, without interreflection.
// Camera rays that hit nothing see 1.
#pragma once

#include <memory>

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {

std::unique_ptr<Method> make_ao_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                       const MethodSpec& spec);

}  // namespace lightmill
