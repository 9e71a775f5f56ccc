// Scenes as they would look if what fills shapes took no light away.
#pragma once

#include "common/scene/document.h"

namespace lightmill {

/// Of all materials' interiors; what they scatter stays.
inline void remove_absorption(Scene& scene) {
  for (Material& material : scene.materials) {
    material.interior.absorption = {};
  }
}

}  // namespace lightmill
