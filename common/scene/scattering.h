// Whether light is scattered between surfaces.
#pragma once

#include <algorithm>

#include "common/scene/document.h"

namespace lightmill {

/// Whether any shape holds a medium that scatters.
inline bool has_scattering_media(const Scene& scene) {
  return std::ranges::any_of(scene.objects, [&](const Object& object) {
    const Material& material = scene.materials[object.material];
    return is_boundary(material) && material.interior.scattering != RgbColor{};
  });
}

}  // namespace lightmill
