#include "common/scene/compiled/material_rows.h"

namespace lightmill {
namespace {

std::shared_ptr<const Material> part_of(const Material& owner, const Material& part) {
  auto row = std::make_shared<Material>(owner);
  row->kind = part.kind;
  row->roughness_map = part.roughness_map;
  row->metallic_map = part.metallic_map;
  row->single_scattering = part.single_scattering;
  return row;
}

}  // namespace

MaterialRows material_rows(const Scene& scene) {
  MaterialRows rows;
  for (const Material& material : scene.materials) {
    rows.owners.push_back(static_cast<std::uint32_t>(rows.materials.size()));
    rows.materials.emplace_back(std::shared_ptr<const Material>(), &material);
  }
  // Parts that are mixtures follow in the same loop.
  for (std::size_t i = 0; i < rows.materials.size(); ++i) {
    std::array<std::uint32_t, 2>& parts = rows.parts.emplace_back();
    const auto* const mixture = std::get_if<MixtureMaterial>(&rows.materials[i]->kind);
    if (mixture == nullptr) {
      continue;
    }
    const Material& owner = scene.materials[rows.owners[i]];
    for (const auto& [at, part] : {std::pair{&parts[0], mixture->first}, {&parts[1], mixture->second}}) {
      *at = static_cast<std::uint32_t>(rows.materials.size());
      rows.materials.push_back(part_of(owner, *part));
      rows.owners.push_back(rows.owners[i]);
    }
  }
  return rows;
}

}  // namespace lightmill
