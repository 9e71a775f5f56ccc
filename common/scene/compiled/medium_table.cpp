#include "common/scene/compiled/medium_table.h"

#include <set>

#include "common/scene/compiled/convert.h"

namespace lightmill {
namespace {

struct Slots8 {
  U8 s[MediumTable::kMaxDepth];
  explicit Slots8(const Media8& m) : s{m.low & U8(0xffffu), m.low >> 16, m.high & U8(0xffffu), m.high >> 16} {}
  Media8 packed() const { return {s[0] | (s[1] << 16), s[2] | (s[3] << 16)}; }
};

M8 is_none(U8 medium) {
  return medium == U8(0u);
}

bool overlap(const Bounds& a, const Bounds& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

}  // namespace

MediumTable::MediumTable(const Scene& scene, double length_scale)
    : priority_{0x80000000u},
      ior_{1.0f},
      extinction_{0, 0, 0},
      scattering_{0, 0, 0},
      anisotropy_{0},
      scatters_(has_scattering_media(scene)),
      plain_{0} {
  for (const Material& material : scene.materials) {
    if (!is_boundary(material)) {
      of_material_.push_back(0);
      continue;
    }
    of_material_.push_back(static_cast<std::uint32_t>(ior_.size()));
    priority_.push_back(static_cast<std::uint32_t>(material.priority));
    ior_.push_back(static_cast<float>(inner_ior(material)));
    plain_.push_back(std::holds_alternative<DielectricMaterial>(material.kind) ? 1 : 0);
    const Vec3d scattering = Vec3d(to_vec(material.interior.scattering)) / length_scale;
    const Vec3d extinction = Vec3d(to_vec(material.interior.absorption)) / length_scale + scattering;
    append(extinction_, Vec3(glm::min(extinction, Vec3d(kMaxAbsorption))));
    append(scattering_, Vec3(glm::min(scattering, Vec3d(kMaxAbsorption))));
    anisotropy_.push_back(static_cast<float>(material.interior.anisotropy));
  }
}

U8 MediumTable::current(const Media8& media) const {
  const Slots8 slots(select(overfull(media), Media8{U8(0u), U8(0u)}, media));
  const M8 all(true);
  U8 best = slots.s[0];
  U8 best_priority = gather(priority_.data(), best, all);
  for (int i = 1; i < kMaxDepth; ++i) {
    const U8 priority = gather(priority_.data(), slots.s[i], all);
    const M8 better = and_not(~signed_less(priority, best_priority), is_none(slots.s[i]));
    best = select(better, slots.s[i], best);
    best_priority = select(better, priority, best_priority);
  }
  return best;
}

Media8 MediumTable::entered(const Media8& media, U8 medium) {
  Slots8 slots(media);
  const M8 full = ~is_none(slots.s[kMaxDepth - 1]);
  M8 placed;
  for (U8& slot : slots.s) {
    const M8 here = and_not(is_none(slot), placed);
    slot = select(here, medium, slot);
    placed = placed | here;
  }
  return select(full, Media8{U8(0xffffffffu), U8(0xffffffffu)}, slots.packed());
}

Media8 MediumTable::left(const Media8& media, U8 medium) {
  const Slots8 slots(media);
  // If it was entered several times, the last entry is removed.
  M8 found, here[kMaxDepth];
  for (int i = kMaxDepth - 1; i >= 0; --i) {
    here[i] = and_not(slots.s[i] == medium, found);
    found = found | here[i];
  }
  // Later entries move down.
  Slots8 rest(media);
  M8 passed;
  for (int i = 0; i < kMaxDepth; ++i) {
    passed = passed | here[i];
    rest.s[i] = select(passed, i + 1 < kMaxDepth ? slots.s[i + 1] : U8(0u), slots.s[i]);
  }
  return rest.packed();
}

Crossing8 MediumTable::cross(const Media8& media, U8 medium, M8 from_outside) const {
  const M8 all(true);
  const Media8 without = select(from_outside, media, left(media, medium));
  // With open shapes a path can leave a medium that it never entered.
  const M8 unknown = and_not((without.low == media.low) & (without.high == media.high), from_outside);
  const Media8 with = select(and_not(from_outside | unknown, medium == U8(0u)), entered(media, medium), media);
  const U8 outer = current(without);
  const F8 inner_ior = gather(ior_.data(), medium, all);
  const F8 outer_ior = gather(ior_.data(), outer, all);
  const M8 matched = (inner_ior == outer_ior) & (gather(plain_.data(), medium, all) == U8(1u));
  return {select(from_outside, inner_ior / outer_ior, outer_ior / inner_ior), select(from_outside, with, without),
          and_not(current(with) == medium, (outer == medium) | matched)};
}

bool needs_media(const Scene& scene, const std::vector<Bounds>& object_bounds) {
  std::vector<std::size_t> boundaries;
  std::set<std::uint32_t> faces;
  bool has_plane = false;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Material& material = scene.materials[object.material];
    if (!is_boundary(material)) {
      continue;
    }
    if (material.interior != Medium{} || material.priority != 0 || inner_ior(material) == 1) {
      return true;
    }
    // Several objects may be faces of one shape. Then their own bounds do not help.
    if (!std::holds_alternative<SphereShape>(object.shape) && !faces.insert(object.material).second) {
      return true;
    }
    has_plane = has_plane || std::holds_alternative<PlaneShape>(object.shape);
    boundaries.push_back(i);
  }
  if (has_plane) {
    return boundaries.size() > 1;
  }
  // With too many pairs to compare, some will overlap.
  constexpr std::size_t kMaxCompared = 1000;
  if (boundaries.size() > kMaxCompared) {
    return true;
  }
  for (std::size_t i = 0; i < boundaries.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (overlap(object_bounds[boundaries[i]], object_bounds[boundaries[j]])) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace lightmill
