// `whitted`: `raycast` seen through mirrors and all that is smooth: metal, glass, gloss, coats. Whitted 1980, "An
// Improved Illumination Model for Shaded Display".
//
// At glass both branches are followed, each weighted by Fresnel's equations, or by the fixed reflectance that `glass=R`
// asks for (all is reflected beyond the critical angle in either case). A branch ends where it carries less than 1e-5
// of what it leads to, or after max_bounces reflections and refractions (128 at most); no camera ray has more than 4096
// branches. Media absorb along all ways; what they scatter is lost, and so is light that surfaces throw onto each
// other. What stops light casts a hard shadow, glass like anything else. Rough metal, glass, gloss and coats are shaded
// as in `raycast`, without reflections; where a texture of roughness makes them smooth, they are followed.
#pragma once

#include <memory>

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {

std::unique_ptr<Method> make_whitted_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                            const MethodSpec& spec);

}  // namespace lightmill
