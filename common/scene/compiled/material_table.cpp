#include "common/scene/compiled/material_table.h"

#include <set>

#include "common/base/overloaded.h"
#include "common/scene/compiled/convert.h"

namespace lightmill {

static_assert(kNoTexture == TextureSet::kNone);

MaterialTable::MaterialTable(const Scene& scene, TextureSet textures) : textures_(std::move(textures)) {
  for (const Material& material : scene.materials) {
    add(material);
  }
  std::set<MaterialKind> used;
  for (const Object& object : scene.objects) {
    used.insert(static_cast<MaterialKind>(kind_[object.material]));
  }
  kinds_.assign(used.begin(), used.end());
  if (kinds_.size() == 1) {
    only_kind_ = kinds_.front();
  }
}

void MaterialTable::ColorColumn::add(const TexturedColor& color) {
  append(rgb, to_vec(color.rgb));
  texture.push_back(color.texture);
  textured = textured || color.texture != kNoTexture;
}

void MaterialTable::add(const Material& material) {
  MaterialKind kind = MaterialKind::diffuse;
  TexturedColor reflectance{1, 1, 1};
  double ior = 1;
  std::visit(Overloaded{[&](const DiffuseMaterial& m) { reflectance = m.reflectance; },
                        [&](const MirrorMaterial& m) {
                          kind = MaterialKind::mirror;
                          reflectance = m.reflectance;
                        },
                        [&](const DielectricMaterial& m) {
                          kind = MaterialKind::dielectric;
                          ior = m.ior;
                        }},
             material.kind);
  kind_.push_back(static_cast<std::uint32_t>(kind));
  emits_.push_back(is_black(material.emission) ? 0 : material.two_sided_emission ? 2 : 1);
  ior_.push_back(static_cast<float>(ior));
  reflectance_.add(reflectance);
  emission_.add(material.emission);
}

V8 MaterialTable::texture_at(const ColorColumn& column, const Surface8& surface, M8 lanes) const {
  return textures_.lookup(gather(column.texture.data(), surface.material, lanes), surface.u, surface.v, lanes).rgb;
}

}  // namespace lightmill
