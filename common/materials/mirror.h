// A perfect mirror.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill::mirror {

inline BsdfSample8 sample(const V8& reflectance, const V8& wo) {
  return {{-wo.x, -wo.y, wo.z}, reflectance, F8(0.0f)};
}

}  // namespace lightmill::mirror
