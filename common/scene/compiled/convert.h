// Conversion of the document's plain numbers to vectors and arrays.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "common/math/vec.h"
#include "common/scene/document.h"

namespace lightmill {

inline Vec3d to_vec(const Point3d& p) {
  return {p[0], p[1], p[2]};
}
inline Vec3 to_vec(const RgbColor& c) {
  return {c.r, c.g, c.b};
}
/// 1 + the index of a light group in light_groups_of(scene). 0 for none.
inline std::uint32_t number_of_group(const std::vector<std::string>& groups, const std::string& group) {
  const auto found = std::ranges::find(groups, group);
  return found == groups.end() ? 0 : static_cast<std::uint32_t>(found - groups.begin()) + 1;
}
inline void append(std::vector<float>& array, const Vec3& v) {
  array.insert(array.end(), {v.x, v.y, v.z});
}

}  // namespace lightmill
