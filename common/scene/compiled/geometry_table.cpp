#include "common/scene/compiled/geometry_table.h"

#include "common/lights/light_sample.h"
#include "common/math/stretch.h"
#include "common/scene/compiled/convert.h"

namespace lightmill {
namespace {

/// Row `geometry` of an array of 3×3 matrices by columns, times v.
V8 multiply(const std::vector<float>& matrices, U8 geometry, const V8& v, M8 lanes) {
  const U8 column = geometry + geometry + geometry;
  return gather3(matrices.data(), column, lanes) * v.x + gather3(matrices.data(), column + U8(1u), lanes) * v.y +
         gather3(matrices.data(), column + U8(2u), lanes) * v.z;
}

/// gather_rows_of_four for rare surfaces. Not inlined, so that the compiler still inlines the common calls.
[[gnu::noinline]] V8 gather_rare_rows(const std::vector<float>& rows, U8 row, M8 lanes) {
  return gather_rows_of_four(rows.data(), row, lanes);
}

void append(std::vector<float>& array, const glm::mat3& m) {
  for (int column = 0; column < 3; ++column) {
    lightmill::append(array, Vec3(m[column]));
  }
}

/// GeometryTable::coordinates_per_length of a triangle.
float density_of_coordinates(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                             const std::vector<std::array<float, 3>>& positions) {
  const auto point = [&](std::size_t i) {
    const std::array<float, 3>& p = positions[triangle[i]];
    return Vec3d(p[0], p[1], p[2]);
  };
  const auto to = [&](std::size_t i, std::size_t axis) {
    return double{mesh.texture_coordinates[triangle[i]][axis]} - mesh.texture_coordinates[triangle[0]][axis];
  };
  // The triangle in its plane: a corner at the origin, an edge along the first axis.
  const Vec3d p1 = point(1) - point(0), p2 = point(2) - point(0);
  const double along = glm::length(p1), x2 = glm::dot(p1, p2) / along, y2 = glm::length(glm::cross(p1, p2)) / along;
  std::array<std::array<double, 2>, 2> coordinates_by_place{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double by_x = to(1, axis) / along;
    coordinates_by_place[axis] = {by_x, (to(2, axis) - by_x * x2) / y2};
  }
  const auto density = static_cast<float>(least_stretch(coordinates_by_place));
  return std::isfinite(density) ? density : 0;
}

}  // namespace

// ---- building ----

void GeometryTable::push(Shape shape, std::uint32_t material, const MeshRows& mesh, TangentUse use, const Vec3& center,
                         float radius, bool inward, const glm::mat3& linear, const glm::mat3& normal) {
  shape_.push_back(shape);
  material_.push_back(material);
  inward_.push_back(inward ? 1 : 0);
  extents_.push_back(mesh.extents);
  first_corner_.push_back(mesh.corners);
  first_normal_.push_back(mesh.normals);
  first_coordinate_.push_back(mesh.coordinates);
  first_color_.push_back(mesh.colors);
  first_derivative_.push_back(mesh.derivatives);
  first_tangent_.push_back(mesh.tangents);
  const bool mapped = use.normals && mesh.derivatives != kNone && (shape == kPlane || mesh.coordinates != kNone);
  const bool directed = use.anisotropy && mesh.derivatives != kNone;
  mapped_.push_back(mapped ? 1 : 0);
  directed_.push_back(directed ? 1 : 0);
  has_mapped_normals_ |= mapped;
  has_directions_ |= directed;
  center_.push_back(center);
  radius_.push_back(radius);
  append(linear_, linear);
  append(normal_matrix_, normal);
  length_scale_.push_back(static_cast<float>(largest_stretch(glm::dmat3(linear))));
}

void GeometryTable::add_extent(const Vec3& extent, float coordinates_per_length) {
  triangle_extent_.insert(triangle_extent_.end(), {extent.x, extent.y, extent.z, coordinates_per_length});
}

void GeometryTable::add_sphere(std::uint32_t material, const Vec3& center, float radius, bool normal_inward) {
  push(kSphere, material, {static_cast<std::uint32_t>(triangle_extent_.size() / 4), 0, kNone, kNone, kNone}, {}, center,
       radius, normal_inward);
  has_spheres_ = true;
  add_extent(Vec3(0));  // a sphere's only primitive
}

void GeometryTable::add_plane(std::uint32_t material, const Vec3& point, float coordinate_scale, bool textured,
                              TangentUse use) {
  push(kPlane, material,
       {static_cast<std::uint32_t>(triangle_extent_.size() / 4), 0, kNone, kNone, kNone, use.any() ? 0 : kNone}, use,
       point, coordinate_scale);
  has_planes_ = true;
  has_coordinates_ |= textured;
  add_extent(Vec3(0));
}

void GeometryTable::add_mesh(std::uint32_t material, const MeshRows& mesh, TangentUse use) {
  push(kMesh, material, mesh, use);
}

void GeometryTable::add_instance(std::uint32_t material, const MeshRows& mesh, TangentUse use, const glm::mat3& linear,
                                 const glm::mat3& normal) {
  push(kInstance, material, mesh, use, Vec3(0), 0, false, linear, normal);
  has_instances_ = true;
}

GeometryTable::MeshRows GeometryTable::add_rows(const Mesh& mesh, const std::vector<std::array<float, 3>>& positions,
                                                bool textured, bool tangents) {
  MeshRows rows{static_cast<std::uint32_t>(triangle_extent_.size() / 4),
                static_cast<std::uint32_t>(corners_.size() / 3), kNone, kNone, kNone};
  const bool coordinates = textured && !mesh.texture_coordinates.empty();
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](int i) { return Vec3(positions[t[i]][0], positions[t[i]][1], positions[t[i]][2]); };
    add_extent(
        glm::max(glm::max(corner(0), corner(1)), corner(2)) - glm::min(glm::min(corner(0), corner(1)), corner(2)),
        coordinates ? density_of_coordinates(mesh, t, positions) : 0);
  }
  const bool derivatives = tangents && !(mesh.texture_coordinates.empty() && mesh.tangents.empty());
  if (mesh.normals.empty() && !coordinates && !derivatives && mesh.colors.empty()) {
    return rows;
  }
  for (const auto& t : mesh.triangles) {
    corners_.insert(corners_.end(), t.begin(), t.end());
  }
  if (!mesh.normals.empty()) {
    has_normals_ = true;
    rows.normals = static_cast<std::uint32_t>(vertex_normals_.size() / 3);
    for (const auto& n : mesh.normals) {
      lightmill::append(vertex_normals_, Vec3(n[0], n[1], n[2]));
    }
  }
  if (coordinates) {
    has_coordinates_ = true;
    rows.coordinates = static_cast<std::uint32_t>(texture_coordinates_.size() / 2);
    for (const auto& c : mesh.texture_coordinates) {
      texture_coordinates_.insert(texture_coordinates_.end(), c.begin(), c.end());
    }
  }
  if (!mesh.colors.empty()) {
    has_colors_ = true;
    rows.colors = static_cast<std::uint32_t>(vertex_colors_.size() / 4);
    for (const auto& c : mesh.colors) {
      vertex_colors_.insert(vertex_colors_.end(), c.begin(), c.end());
    }
  }
  if (derivatives) {
    rows.derivatives = static_cast<std::uint32_t>(derivatives_.size() / 8);
    add_derivatives(mesh, positions);
    if (!mesh.tangents.empty()) {
      rows.tangents = static_cast<std::uint32_t>(vertex_tangents_.size() / 4);
      for (const auto& t : mesh.tangents) {
        vertex_tangents_.insert(vertex_tangents_.end(), t.begin(), t.end());
      }
    }
  }
  return rows;
}

/// Triangles whose texture coordinates span no area have none.
void GeometryTable::add_derivatives(const Mesh& mesh, const std::vector<std::array<float, 3>>& positions) {
  if (mesh.texture_coordinates.empty()) {
    derivatives_.resize(derivatives_.size() + 8 * mesh.triangles.size());
    return;
  }
  for (const auto& t : mesh.triangles) {
    const auto point = [&](std::size_t i) { return Vec3d(positions[t[i]][0], positions[t[i]][1], positions[t[i]][2]); };
    const auto to = [&](std::size_t i, std::size_t axis) {
      return double{mesh.texture_coordinates[t[i]][axis]} - mesh.texture_coordinates[t[0]][axis];
    };
    const Vec3d p1 = point(1) - point(0), p2 = point(2) - point(0);
    const double area = to(1, 0) * to(2, 1) - to(2, 0) * to(1, 1);
    const Vec3 by_u((p1 * to(2, 1) - p2 * to(1, 1)) / area), by_v((p2 * to(1, 0) - p1 * to(2, 0)) / area);
    const float spanned = glm::dot(glm::cross(by_u, by_v), glm::cross(by_u, by_v));
    for (const Vec3& v : {by_u, by_v}) {
      lightmill::append(derivatives_, spanned > 0 && std::isfinite(spanned) ? v : Vec3(0));
      derivatives_.push_back(0);
    }
  }
}

std::uint64_t GeometryTable::bytes() const {
  return shape_.size() * 128 + (triangle_extent_.size() + corners_.size() + vertex_normals_.size()) * 4 +
         (texture_coordinates_.size() + vertex_colors_.size() + derivatives_.size() + vertex_tangents_.size()) * 4;
}

// ---- looking up ----

Surface8 GeometryTable::surface(const Ray8& rays, const Hit8& hits) const {
  const M8 lanes = hits.hit;
  Surface8 s;
  s.material = material_.at(hits.geometry, lanes);
  s.point = rays.origin + rays.direction * hits.distance;
  const U8 triangle = extents_.at(hits.geometry, lanes) + hits.primitive;
  V8 extent = gather_rows_of_four(triangle_extent_.data(), triangle, lanes);
  V8 normal = hits.normal;
  M8 instances;
  if (has_instances_) {
    instances = is_shape(kInstance, hits.geometry, lanes);
    if (instances.any()) {
      normal = select(instances, multiply(normal_matrix_, hits.geometry, normal, instances), normal);
      const U8 column = hits.geometry + hits.geometry + hits.geometry;
      const V8 mapped = abs(gather3(linear_.data(), column, instances)) * extent.x +
                        abs(gather3(linear_.data(), column + U8(1u), instances)) * extent.y +
                        abs(gather3(linear_.data(), column + U8(2u), instances)) * extent.z;
      extent = select(instances, mapped, extent);
    }
  }
  s.geometric_normal = normalize(normal);
  // The error of a hit's coordinate grows with the coordinate and with the ray's distance to the hit. It also grows
  // with the distance from the ray to the triangle's corners.
  V8 magnitude = abs(s.point) + abs(rays.direction) * hits.distance + extent;
  if (const M8 spheres = has_spheres_ ? is_shape(kSphere, hits.geometry, lanes) : M8(); spheres.any()) {
    put_back_onto_spheres(hits, spheres, s, magnitude);
  }
  if (has_planes_) {
    put_back_onto_planes(hits, is_shape(kPlane, hits.geometry, lanes), s);
  }
  s.front = lanes & (dot(rays.direction, s.geometric_normal) < F8(0.0f));
  s.offset = surface_offset(s.geometric_normal, magnitude);
  s.shading_normal = s.geometric_normal;
  if (has_mapped_normals_) {
    s.mapped = lanes & (mapped_.at(hits.geometry, lanes) == U8(1u));
  }
  if (has_directions_) {
    s.directed = lanes & (directed_.at(hits.geometry, lanes) == U8(1u));
  }
  if (has_normals_) {
    interpolate_normals(rays, hits, instances, s);
  }
  if (has_coordinates_) {
    find_texture_coordinates(hits, s);
  }
  if (has_colors_) {
    interpolate_colors(hits, s);
  }
  return s;
}

/// This removes the error that the ray's length causes.
void GeometryTable::put_back_onto_spheres(const Hit8& hits, M8 lanes, Surface8& s, V8& magnitude) const {
  const V8 center = center_.at(hits.geometry, lanes);
  const F8 radius = radius_.at(hits.geometry, lanes);
  const V8 outward = normalize(s.point - center);
  s.point = select(lanes, center + outward * radius, s.point);
  magnitude = select(lanes, abs(s.point) + V8{radius, radius, radius}, magnitude);
  const M8 inward = inward_.at(hits.geometry, lanes) == U8(1u);
  s.geometric_normal = select(lanes, select(inward, -outward, outward), s.geometric_normal);
}

void GeometryTable::put_back_onto_planes(const Hit8& hits, M8 lanes, Surface8& s) const {
  const V8 point = center_.at(hits.geometry, lanes);
  const F8 height = dot(s.geometric_normal, s.point - point);
  s.point = select(lanes, s.point - s.geometric_normal * height, s.point);
}

std::array<U8, 3> GeometryTable::corners(const Hit8& hits, U8 first, M8 lanes) const {
  const U8 triangle = first_corner_.at(hits.geometry, lanes) + hits.primitive;
  const U8 corner = triangle + triangle + triangle;
  return {first + gather(corners_.data(), corner, lanes), first + gather(corners_.data(), corner + U8(1u), lanes),
          first + gather(corners_.data(), corner + U8(2u), lanes)};
}

void GeometryTable::interpolate_normals(const Ray8& rays, const Hit8& hits, M8 instances, Surface8& s) const {
  const U8 first = first_normal_.at(hits.geometry, hits.hit);
  const M8 smooth = and_not(hits.hit, first == U8(kNone));
  if (smooth.none()) {
    return;
  }
  const std::array<U8, 3> c = corners(hits, first, smooth);
  V8 n = gather3(vertex_normals_.data(), c[0], smooth) * (F8(1.0f) - hits.u - hits.v) +
         gather3(vertex_normals_.data(), c[1], smooth) * hits.u +
         gather3(vertex_normals_.data(), c[2], smooth) * hits.v;
  if (const M8 mapped = smooth & instances; mapped.any()) {
    n = select(mapped, multiply(normal_matrix_, hits.geometry, n, mapped), n);
  }
  const F8 length2 = length_squared(n);
  const M8 usable = smooth & (length2 > F8(1e-12f));
  n = n * (F8(1.0f) / sqrt(length2));
  n = select(dot(n, s.geometric_normal) < F8(0.0f), -n, n);
  // If the ray comes from behind the interpolated normal, there is no frame to shade in. The flat normal is used. For
  // mapped normals, shading_frame.h has another rule.
  const F8 cosine = dot(rays.direction, n);
  const M8 consistent = ~((cosine < F8(0.0f)) & ~s.front) & ~((cosine >= F8(0.0f)) & s.front);
  s.shading_normal = select(usable & (consistent | s.mapped), n, s.shading_normal);
}

/// White and opaque where the mesh has no colours.
void GeometryTable::interpolate_colors(const Hit8& hits, Surface8& s) const {
  s.color = broadcast(Vec3(1));
  s.alpha = F8(1.0f);
  const U8 first = first_color_.at(hits.geometry, hits.hit);
  const M8 colored = and_not(hits.hit, first == U8(kNone));
  if (colored.none()) {
    return;
  }
  const std::array<U8, 3> c = corners(hits, first, colored);
  const F8 w = F8(1.0f) - hits.u - hits.v;
  const auto interpolate = [&](int channel) {
    const float* const base = vertex_colors_.data() + channel;
    const F8 value = gather(base, c[0] << 2, colored) * w + gather(base, c[1] << 2, colored) * hits.u +
                     gather(base, c[2] << 2, colored) * hits.v;
    return select(colored, min(max(value, F8(0.0f)), F8(1.0f)), F8(1.0f));  // rounding
  };
  s.color = {interpolate(0), interpolate(1), interpolate(2)};
  s.alpha = interpolate(3);
}

void GeometryTable::find_texture_coordinates(const Hit8& hits, Surface8& s) const {
  const U8 first = first_coordinate_.at(hits.geometry, hits.hit);
  if (const M8 mapped = and_not(hits.hit, first == U8(kNone)); mapped.any()) {
    const std::array<U8, 3> c = corners(hits, first, mapped);
    const F8 w = F8(1.0f) - hits.u - hits.v;
    const auto interpolate = [&](const float* base) {
      return masked(mapped, gather(base, c[0] + c[0], mapped) * w + gather(base, c[1] + c[1], mapped) * hits.u +
                                gather(base, c[2] + c[2], mapped) * hits.v);
    };
    s.u = interpolate(texture_coordinates_.data());
    s.v = interpolate(texture_coordinates_.data() + 1);
  }
  if (has_planes_) {
    if (const M8 planes = is_shape(kPlane, hits.geometry, hits.hit); planes.any()) {
      const Frame8 frame(s.geometric_normal);
      const V8 local = frame.to_local(s.point - center_.at(hits.geometry, planes));
      const F8 scale = radius_.at(hits.geometry, planes);
      s.u = select(planes, local.x * scale, s.u);
      s.v = select(planes, local.y * scale, s.v);
    }
  }
}

F8 GeometryTable::coordinates_per_length(const Hit8& hits, M8 lanes) const {
  if (!has_coordinates_) {
    return F8(0.0f);
  }
  const U8 triangle = extents_.at(hits.geometry, lanes) + hits.primitive;
  F8 density = gather(triangle_extent_.data() + 3, triangle << 2, lanes);
  if (has_instances_) {
    const M8 instances = is_shape(kInstance, hits.geometry, lanes);
    density = select(instances, density / length_scale_.at(hits.geometry, instances), density);
  }
  if (has_planes_) {
    const M8 planes = is_shape(kPlane, hits.geometry, lanes);
    density = select(planes, radius_.at(hits.geometry, planes), density);
  }
  return density;
}

Tangents8 GeometryTable::derivatives(const Hit8& hits, const Surface8& surface, M8 lanes) const {
  Tangents8 out;
  const M8 planes = has_planes_ ? is_shape(kPlane, hits.geometry, lanes) : M8();
  if (const M8 meshes = and_not(lanes, planes); meshes.any()) {
    const U8 row = (first_derivative_.at(hits.geometry, meshes) + hits.primitive) << 1;
    out = {gather_rare_rows(derivatives_, row, meshes), gather_rare_rows(derivatives_, row + U8(1u), meshes)};
  }
  if (const M8 instances = has_instances_ ? is_shape(kInstance, hits.geometry, lanes) : M8(); instances.any()) {
    out = {select(instances, multiply(linear_, hits.geometry, out.u, instances), out.u),
           select(instances, multiply(linear_, hits.geometry, out.v, instances), out.v)};
  }
  if (planes.any()) {
    const Frame8 frame(surface.geometric_normal);
    const F8 per_unit = F8(1.0f) / radius_.at(hits.geometry, planes);
    out = {select(planes, frame.s * per_unit, out.u), select(planes, frame.t * per_unit, out.v)};
  }
  return out;
}

/// A mirrored instance turns the frame over.
void GeometryTable::use_vertex_tangents(const Hit8& hits, const Surface8& surface, M8 lanes,
                                        Tangents8& tangents) const {
  const U8 first = first_tangent_.at(hits.geometry, lanes);
  const M8 given = and_not(lanes, first == U8(kNone));
  if (given.none()) {
    return;
  }
  const std::array<U8, 3> c = corners(hits, first, given);
  const auto at = [&](U8 vertex) { return gather_rare_rows(vertex_tangents_, vertex, given); };
  V8 u = at(c[0]) * (F8(1.0f) - hits.u - hits.v) + at(c[1]) * hits.u + at(c[2]) * hits.v;
  F8 sign = gather(vertex_tangents_.data() + 3, c[0] << 2, given);
  if (const M8 instances = has_instances_ ? is_shape(kInstance, hits.geometry, given) : M8(); instances.any()) {
    const U8 column = hits.geometry + hits.geometry + hits.geometry;
    const auto axis = [&](std::uint32_t i) { return gather3(linear_.data(), column + U8(i), instances); };
    const M8 mirrored = instances & (dot(axis(0), cross(axis(1), axis(2))) < F8(0.0f));
    sign = select(mirrored, -sign, sign);
    u = select(instances, multiply(linear_, hits.geometry, u, instances), u);
  }
  tangents.u = select(given, u, tangents.u);
  tangents.v = select(given, cross(surface.shading_normal, u) * sign, tangents.v);
}

}  // namespace lightmill
