// The materials of a scene as the renderer looks them up: structures of arrays, one row a material.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/math/vec.h"
#include "common/scene/document.h"

namespace lightmill {

enum class MaterialKind : std::uint32_t { diffuse, mirror, dielectric };

class MaterialTable {
 public:
  MaterialTable() = default;
  explicit MaterialTable(const Scene& scene);

  /// The kinds that objects of the scene have, ascending.
  const std::vector<MaterialKind>& kinds() const { return kinds_; }
  /// The one kind there is, if there is but one.
  std::optional<MaterialKind> only_kind() const { return only_kind_; }

  M8 is_kind(U8 material, MaterialKind kind, M8 lanes) const {
    return lanes & (gather(kind_.data(), material, lanes) == U8(static_cast<std::uint32_t>(kind)));
  }
  V8 reflectance(U8 material, M8 lanes) const { return gather3(reflectance_.data(), material, lanes); }
  /// How much of light each channel scatters, as far as one colour can say it; 1 for clear glass.
  V8 albedo(U8 material, M8 lanes) const { return reflectance(material, lanes); }
  F8 ior(U8 material, M8 lanes) const { return gather(ior_.data(), material, lanes); }
  V8 emission(U8 material, M8 lanes) const { return gather3(emission_.data(), material, lanes); }
  /// Which hits see emitted light, given whether they are on the front.
  M8 emits(U8 material, M8 front, M8 lanes) const {
    const U8 sides = gather(emits_.data(), material, lanes);
    return lanes & (((sides == U8(1u)) & front) | (sides == U8(2u)));
  }

 private:
  void add(const Material& material);

  std::vector<MaterialKind> kinds_;
  std::optional<MaterialKind> only_kind_;
  // One entry a material (3 for colours).
  std::vector<std::uint32_t> kind_;
  std::vector<std::uint32_t> emits_;  ///< 0 never, 1 on the front, 2 on both sides
  std::vector<float> reflectance_, emission_, ior_;
};

}  // namespace lightmill
