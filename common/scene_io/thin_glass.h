// A pane of glass without thickness.
#pragma once

#include "common/scene/document/material.h"

namespace lightmill {

/// A mirror that rays pass with the probability of transmission. It reflects the same share at all angles: that of light
/// along the normal, R, with the light that is reflected to and fro in the pane: 2R/(1 + R).
inline Material thin_glass(double ior) {
  const double r = (ior - 1) * (ior - 1) / ((ior + 1) * (ior + 1));
  Material out;
  out.kind = MirrorMaterial{};
  out.opacity = {Opacity::Mode::blend, 2 * r / (1 + r)};
  return out;
}

}  // namespace lightmill
