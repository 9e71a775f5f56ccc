// Perfect mirror BSDF.
#pragma once

#include "common/materials/bsdf.h"

namespace lightmill {

struct Mirror8 {
  V8 reflectance;

  BsdfSample8 sample(const V8& wo) const { return {{-wo.x, -wo.y, wo.z}, reflectance, F8(0.0f), M8(), F8(1.0f)}; }
};

}  // namespace lightmill
