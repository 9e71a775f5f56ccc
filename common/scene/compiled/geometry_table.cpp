#include "common/scene/compiled/geometry_table.h"

#include "common/lights/light_table.h"
#include "common/scene/compiled/convert.h"

namespace lightmill {

void GeometryTable::push(std::uint32_t material) {
  material_.push_back(material);
  is_sphere_.push_back(0);
  inward_.push_back(0);
  smooth_.push_back(0);
  triangles_.push_back(static_cast<std::uint32_t>(triangle_extent_.size() / 3));
  smooth_triangles_.push_back(static_cast<std::uint32_t>(corners_.size() / 3));
  append(sphere_center_, Vec3(0));
  sphere_radius_.push_back(0);
}

void GeometryTable::add_sphere(std::uint32_t material, const Vec3& center, float radius, bool normal_inward) {
  push(material);
  has_spheres_ = true;
  is_sphere_.back() = 1;
  inward_.back() = normal_inward ? 1 : 0;
  std::copy_n(&center.x, 3, sphere_center_.end() - 3);
  sphere_radius_.back() = radius;
  append(triangle_extent_, Vec3(0));  // a sphere's only primitive
}

void GeometryTable::add_mesh(std::uint32_t material, const Mesh& mesh,
                             const std::vector<std::array<float, 3>>& positions) {
  push(material);
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](int i) { return Vec3(positions[t[i]][0], positions[t[i]][1], positions[t[i]][2]); };
    append(triangle_extent_,
           glm::max(glm::max(corner(0), corner(1)), corner(2)) - glm::min(glm::min(corner(0), corner(1)), corner(2)));
  }
  if (mesh.normals.empty()) {
    return;
  }
  has_smooth_meshes_ = true;
  smooth_.back() = 1;
  const auto first = static_cast<std::uint32_t>(vertex_normals_.size() / 3);
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t i : t) {
      corners_.push_back(first + i);
    }
  }
  for (const auto& n : mesh.normals) {
    append(vertex_normals_, Vec3(n[0], n[1], n[2]));
  }
}

std::uint64_t GeometryTable::bytes() const {
  return material_.size() * 64 + (triangle_extent_.size() + corners_.size() + vertex_normals_.size()) * 4;
}

Surface8 GeometryTable::surface(const Ray8& rays, const Hit8& hits) const {
  const M8 lanes = hits.hit;
  Surface8 s;
  s.material = gather(material_.data(), hits.geometry, lanes);
  s.point = rays.origin + rays.direction * hits.distance;
  s.geometric_normal = normalize(hits.normal);
  // What a coordinate of the hit may be off by grows with itself, with the ray's way to it and with the way from the
  // ray to the triangle's corners.
  const U8 triangle = gather(triangles_.data(), hits.geometry, lanes) + hits.primitive;
  V8 magnitude = abs(s.point) + abs(rays.direction) * hits.distance + gather3(triangle_extent_.data(), triangle, lanes);

  if (const M8 sphere = is_sphere(hits.geometry, lanes); sphere.any()) {
    // Put the point back onto the sphere: what the ray's length has cost in accuracy is gone then.
    const V8 center = sphere_center(hits.geometry, sphere);
    const F8 radius = sphere_radius(hits.geometry, sphere);
    const V8 outward = normalize(s.point - center);
    s.point = select(sphere, center + outward * radius, s.point);
    magnitude = select(sphere, abs(s.point) + V8{radius, radius, radius}, magnitude);
    const M8 inward = gather(inward_.data(), hits.geometry, sphere) == U8(1u);
    s.geometric_normal = select(sphere, select(inward, -outward, outward), s.geometric_normal);
  }
  s.front = lanes & (dot(rays.direction, s.geometric_normal) < F8(0.0f));
  s.offset = surface_offset(s.geometric_normal, magnitude);
  s.shading_normal = s.geometric_normal;

  if (has_smooth_meshes_) {
    if (const M8 smooth = lanes & (gather(smooth_.data(), hits.geometry, lanes) == U8(1u)); smooth.any()) {
      V8 n = interpolated_normal(hits, smooth);
      const F8 length2 = length_squared(n);
      const M8 usable = smooth & (length2 > F8(1e-12f));
      n = n * (F8(1.0f) / sqrt(length2));
      n = select(dot(n, s.geometric_normal) < F8(0.0f), -n, n);
      // Where the ray comes from behind the interpolated normal there is no frame to shade in: the flat one serves.
      const M8 consistent =
          ~((dot(rays.direction, n) < F8(0.0f)) & ~s.front) & ~((dot(rays.direction, n) >= F8(0.0f)) & s.front);
      s.shading_normal = select(usable & consistent, n, s.shading_normal);
    }
  }
  return s;
}

/// Not normalised.
V8 GeometryTable::interpolated_normal(const Hit8& hits, M8 lanes) const {
  const U8 corners = gather(smooth_triangles_.data(), hits.geometry, lanes) + hits.primitive;
  const U8 first = corners + corners + corners;
  const V8 n0 = gather3(vertex_normals_.data(), gather(corners_.data(), first, lanes), lanes);
  const V8 n1 = gather3(vertex_normals_.data(), gather(corners_.data(), first + U8(1u), lanes), lanes);
  const V8 n2 = gather3(vertex_normals_.data(), gather(corners_.data(), first + U8(2u), lanes), lanes);
  return n0 * (F8(1.0f) - hits.u - hits.v) + n1 * hits.u + n2 * hits.v;
}

}  // namespace lightmill
