#include "common/scene_io/mesh_edits.h"

#include <cmath>
#include <utility>

#include "common/scene/document/values.h"

namespace lightmill {
namespace {

Point3d edge_of(const Mesh& mesh, std::uint32_t from, std::uint32_t to) {
  return difference(mesh.positions[to], mesh.positions[from]);
}

/// (p1−p0)×(p2−p0).
Point3d normal_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return cross(edge_of(mesh, t[0], t[1]), edge_of(mesh, t[0], t[2]));
}

}  // namespace

void reverse_orientation(Mesh& mesh) {
  for (auto& triangle : mesh.triangles) {
    std::swap(triangle[1], triangle[2]);
  }
  for (auto& normal : mesh.normals) {
    normal = {-normal[0], -normal[1], -normal[2]};
  }
}

void follow_normals(Mesh& mesh) {
  for (auto& t : mesh.triangles) {
    const Point3d n = normal_of(mesh, t);
    double side = 0;
    for (const std::uint32_t corner : t) {
      const auto& normal = mesh.normals[corner];
      side += dot(n, {normal[0], normal[1], normal[2]});
    }
    if (side < 0) {
      std::swap(t[1], t[2]);
    }
  }
}

void add_normals(Mesh& mesh) {
  std::vector<Point3d> sums(mesh.positions.size());
  std::vector<bool> used(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    const Point3d n = normal_of(mesh, t);
    const double length = std::sqrt(dot(n, n));
    for (std::size_t i = 0; i < 3; ++i) {
      used[t[i]] = true;
      if (length > 0) {
        const Point3d a = edge_of(mesh, t[i], t[(i + 1) % 3]), b = edge_of(mesh, t[i], t[(i + 2) % 3]);
        const double angle = std::atan2(length, dot(a, b));  // |a × b| is the same at all corners
        for (std::size_t k = 0; k < 3; ++k) {
          sums[t[i]][k] += angle * n[k] / length;
        }
      }
    }
  }
  mesh.normals.assign(mesh.positions.size(), {0, 0, 1});
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double length = std::sqrt(dot(sums[i], sums[i]));
    if (used[i] && !(length > 1e-6)) {
      mesh.normals.clear();
      return;
    }
    for (std::size_t k = 0; used[i] && k < 3; ++k) {
      mesh.normals[i][k] = static_cast<float>(sums[i][k] / length);
    }
  }
}

void add_tangents(Mesh& mesh) {
  std::vector<Point3d> sums(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    const auto &a = mesh.texture_coordinates[t[0]], &b = mesh.texture_coordinates[t[1]],
               &c = mesh.texture_coordinates[t[2]];
    const double u1 = b[0] - a[0], v1 = b[1] - a[1], u2 = c[0] - a[0], v2 = c[1] - a[1];
    const double area = u1 * v2 - u2 * v1;
    const Point3d p = edge_of(mesh, t[0], t[1]), q = edge_of(mesh, t[0], t[2]);
    Point3d along{};
    for (std::size_t k = 0; k < 3; ++k) {
      along[k] = area < 0 ? q[k] * v1 - p[k] * v2 : p[k] * v2 - q[k] * v1;
    }
    const double length = std::sqrt(dot(along, along));
    for (std::size_t i = 0; length > 0 && i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        sums[t[i]][k] += along[k] / length;
      }
    }
  }
  mesh.tangents.clear();
  for (const Point3d& sum : sums) {
    const double length = std::sqrt(dot(sum, sum));
    const Point3d unit = length > 1e-6 ? Point3d{sum[0] / length, sum[1] / length, sum[2] / length} : Point3d{1, 0, 0};
    mesh.tangents.push_back({static_cast<float>(unit[0]), static_cast<float>(unit[1]), static_cast<float>(unit[2]), 1});
  }
}

void set_triangle_coordinates(Mesh& mesh, const std::array<std::array<float, 2>, 3>& coordinates) {
  Mesh out;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    for (const std::uint32_t corner : t) {
      out.positions.push_back(mesh.positions[corner]);
      if (!mesh.normals.empty()) {
        out.normals.push_back(mesh.normals[corner]);
      }
    }
    out.texture_coordinates.insert(out.texture_coordinates.end(), coordinates.begin(), coordinates.end());
    out.triangles.push_back({first, first + 1, first + 2});
  }
  mesh = std::move(out);
}

}  // namespace lightmill
