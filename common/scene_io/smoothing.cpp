#include "common/scene_io/smoothing.h"

#include <algorithm>
#include <cmath>

#include "common/math/vec.h"

namespace lightmill {
namespace {

Vec3d position(const ObjFile& file, const ObjCorner& corner) {
  const auto& p = file.positions[corner.position];
  return {p[0], p[1], p[2]};
}

double length_of(const Vec3d& v) {
  return std::hypot(v.x, v.y, v.z);
}

/// Twice the area, along the normal.
Vec3d area_vector(const ObjFile& file, const ObjTriangle& triangle) {
  const Vec3d a = position(file, triangle[0]);
  return glm::cross(position(file, triangle[1]) - a, position(file, triangle[2]) - a);
}

bool has_normal(const ObjFile& file, const ObjCorner& corner) {
  return corner.normal != kNoIndex && file.normals[corner.normal] != std::array<float, 3>{0, 0, 0};
}

std::array<float, 3> to_floats(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// The normals of one group, one slot per position that it touches.
class GroupNormals {
 public:
  explicit GroupNormals(ObjFile& file) : file_(file), slots_(file.positions.size(), kNoIndex) {}

  void add(const ObjTriangle& triangle) {
    const std::array<Vec3d, 3> p{position(file_, triangle[0]), position(file_, triangle[1]),
                                 position(file_, triangle[2])};
    const Vec3d normal = glm::cross(p[1] - p[0], p[2] - p[0]);
    const double doubled_area = length_of(normal);
    if (!(doubled_area > kNoLength)) {
      return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d to_next = p[(i + 1) % 3] - p[i], to_last = p[(i + 2) % 3] - p[i];
      const double angle = std::atan2(doubled_area, glm::dot(to_next, to_last));
      slot(triangle[i].position).sum += normal * (angle / doubled_area);
    }
  }

  void assign(ObjCorner& corner) {
    const std::uint32_t index = slots_[corner.position];
    if (has_normal(file_, corner) || index == kNoIndex) {
      return;
    }
    Slot& slot = used_[index];
    if (slot.normal == kNoIndex) {
      // Faces back to back leave a sum of about 1e-8.
      const double length = length_of(slot.sum);
      if (!(length > 1e-8)) {
        return;
      }
      slot.normal = static_cast<std::uint32_t>(file_.normals.size());
      file_.normals.push_back(to_floats(slot.sum / length));
    }
    corner.normal = slot.normal;
  }

  void clear() {
    for (const Slot& slot : used_) {
      slots_[slot.position] = kNoIndex;
    }
    used_.clear();
  }

 private:
  struct Slot {
    std::uint32_t position = 0;
    std::uint32_t normal = kNoIndex;
    Vec3d sum{0};
  };

  Slot& slot(std::uint32_t position) {
    if (slots_[position] == kNoIndex) {
      slots_[position] = static_cast<std::uint32_t>(used_.size());
      used_.push_back({position, kNoIndex, Vec3d(0)});
    }
    return used_[slots_[position]];
  }

  ObjFile& file_;
  std::vector<std::uint32_t> slots_;  ///< index into used_ by position
  std::vector<Slot> used_;
};

}  // namespace

bool has_area(const ObjFile& file, const ObjTriangle& triangle) {
  return length_of(area_vector(file, triangle)) > kNoLength;
}

std::array<float, 3> face_normal(const ObjFile& file, const ObjTriangle& triangle) {
  const Vec3d n = area_vector(file, triangle);
  const double length = length_of(n);
  if (!(length > kNoLength)) {
    return {0, 0, 1};
  }
  return to_floats(n / length);
}

void smooth_normals(ObjFile& file, std::span<const SmoothRun> runs) {
  if (runs.empty()) {
    return;
  }
  std::vector<SmoothRun> sorted(runs.begin(), runs.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const SmoothRun& a, const SmoothRun& b) { return a.group < b.group; });
  GroupNormals normals(file);
  const auto triangles_of = [&](const SmoothRun& run) {
    return std::span(file.parts[run.part].triangles).subspan(run.begin, run.end - run.begin);
  };
  for (auto group = sorted.begin(); group != sorted.end();) {
    const auto end = std::find_if(group, sorted.end(), [&](const SmoothRun& r) { return r.group != group->group; });
    for (auto run = group; run != end; ++run) {
      for (const ObjTriangle& triangle : triangles_of(*run)) {
        normals.add(triangle);
      }
    }
    for (auto run = group; run != end; ++run) {
      for (ObjTriangle& triangle : triangles_of(*run)) {
        for (ObjCorner& corner : triangle) {
          normals.assign(corner);
        }
      }
    }
    normals.clear();
    group = end;
  }
}

}  // namespace lightmill
