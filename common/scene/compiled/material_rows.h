// Rows of the tables of materials: the materials of a scene, and the parts of its mixtures.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/scene/document.h"

namespace lightmill {

struct MaterialRows {
  /// First the materials of the scene, which must outlive this, then parts. A part has the emission, opacity and normal
  /// map of its mixture.
  std::vector<std::shared_ptr<const Material>> materials;
  std::vector<std::uint32_t> owners;                ///< of each row: the scene's material that it is or belongs to
  std::vector<std::array<std::uint32_t, 2>> parts;  ///< of each row: the rows of a mixture's two parts, else 0
};

MaterialRows material_rows(const Scene& scene);

}  // namespace lightmill
