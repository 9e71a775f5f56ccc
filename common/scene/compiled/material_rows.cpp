#include "common/scene/compiled/material_rows.h"

namespace lightmill {
namespace {

Material part_of(const Material& owner, const Material& part) {
  Material row = owner;
  row.kind = part.kind;
  row.roughness_map = part.roughness_map;
  row.metallic_map = part.metallic_map;
  row.single_scattering = part.single_scattering;
  return row;
}

}  // namespace

MaterialRows material_rows(const Scene& scene) {
  MaterialRows rows;
  rows.materials = scene.materials;
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    rows.owners.push_back(static_cast<std::uint32_t>(i));
  }
  // Parts that are mixtures follow in the same loop.
  for (std::size_t i = 0; i < rows.materials.size(); ++i) {
    std::array<std::uint32_t, 2>& parts = rows.parts.emplace_back();
    const auto* const found = std::get_if<MixtureMaterial>(&rows.materials[i].kind);
    if (found == nullptr) {
      continue;
    }
    const MixtureMaterial mixture = *found;
    const Material& owner = scene.materials[rows.owners[i]];
    for (const auto& [at, part] : {std::pair{0, mixture.first}, {1, mixture.second}}) {
      parts[static_cast<std::size_t>(at)] = static_cast<std::uint32_t>(rows.materials.size());
      rows.materials.push_back(part_of(owner, *part));
      rows.owners.push_back(rows.owners[i]);
    }
  }
  return rows;
}

}  // namespace lightmill
