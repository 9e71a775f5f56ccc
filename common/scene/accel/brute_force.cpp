#include "common/scene/accel/brute_force.h"

#include <immintrin.h>
#include <cmath>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace lightmill {
namespace {

// Embree's intersectors round a product and a sum once. This decides on which side of an edge a very close ray passes,
// so it is done the same way here.

F8 product_plus(F8 a, F8 b, F8 c) {
  return F8(_mm256_fmadd_ps(a.v, b.v, c.v));
}
F8 product_minus(F8 a, F8 b, F8 c) {
  return F8(_mm256_fmsub_ps(a.v, b.v, c.v));
}
F8 fused_dot(const V8& a, const V8& b) {
  return product_plus(a.x, b.x, product_plus(a.y, b.y, a.z * b.z));
}
V8 fused_cross(const V8& a, const V8& b) {
  return {product_minus(a.y, b.z, a.z * b.y), product_minus(a.z, b.x, a.x * b.z), product_minus(a.x, b.y, a.y * b.x)};
}

Vec3 fused_cross(const Vec3& a, const Vec3& b) {
  return {std::fma(a.y, b.z, -(a.z * b.y)), std::fma(a.z, b.x, -(a.x * b.z)), std::fma(a.x, b.y, -(a.y * b.x))};
}

}  // namespace

std::shared_ptr<const BruteForce::TriangleList> BruteForce::list_of(Positions positions, Triangles triangles) {
  auto list = std::make_shared<TriangleList>();
  list->reserve(triangles.size());
  for (const auto& t : triangles) {
    const auto corner = [&](int i) { return Vec3(positions[t[i]][0], positions[t[i]][1], positions[t[i]][2]); };
    const Vec3 edge1 = corner(0) - corner(1), edge2 = corner(2) - corner(0);
    list->push_back({corner(0), edge1, edge2, fused_cross(edge2, edge1)});
  }
  return list;
}

void BruteForce::add_mesh(std::uint32_t geometry, Positions positions, Triangles triangles) {
  meshes_.push_back({geometry, list_of(positions, triangles), false, {}, Vec3(0)});
}

std::uint32_t BruteForce::add_prototype(Positions positions, Triangles triangles) {
  prototypes_.push_back(list_of(positions, triangles));
  return static_cast<std::uint32_t>(prototypes_.size() - 1);
}

void BruteForce::add_instance(std::uint32_t geometry, std::uint32_t prototype,
                              const std::array<std::array<float, 4>, 3>& to_scene) {
  glm::dmat3 linear;
  for (int column = 0; column < 3; ++column) {
    linear[column] = {to_scene[0][column], to_scene[1][column], to_scene[2][column]};
  }
  const glm::mat3 inverse(glm::inverse(linear));
  meshes_.push_back({geometry,
                     prototypes_[prototype],
                     true,
                     {inverse[0], inverse[1], inverse[2]},
                     Vec3(to_scene[0][3], to_scene[1][3], to_scene[2][3])});
}

void BruteForce::add_sphere(std::uint32_t geometry, const Vec3& center, float radius) {
  spheres_.push_back({geometry, center, radius});
}

Ray8 BruteForce::to_mesh(const Mesh& mesh, const Ray8& rays) {
  const auto map = [&](const V8& v) {
    return broadcast(mesh.inverse_columns[0]) * v.x + broadcast(mesh.inverse_columns[1]) * v.y +
           broadcast(mesh.inverse_columns[2]) * v.z;
  };
  return {map(rays.origin - broadcast(mesh.origin)), map(rays.direction), rays.max_distance};
}

/// Möller and Trumbore 1997, with the operations of Embree's intersector of fast rays, so that both agree.
M8 BruteForce::try_triangle(const Triangle& triangle, const Ray8& rays, F8 min_distance, M8 lanes, Hit8& hit) {
  const V8 edge1 = broadcast(triangle.edge1), edge2 = broadcast(triangle.edge2);
  const V8 normal = broadcast(triangle.normal);
  const V8 to_corner = broadcast(triangle.corner) - rays.origin;
  const V8 r = fused_cross(to_corner, rays.direction);
  const F8 denominator = fused_dot(normal, rays.direction);
  const F8 size = abs(denominator);
  const auto signed_as = [&](F8 x) { return select(denominator < F8(0.0f), -x, x); };
  const F8 u = signed_as(fused_dot(r, edge2));
  const F8 v = signed_as(fused_dot(r, edge1));
  M8 found = lanes & (u >= F8(0.0f)) & (v >= F8(0.0f)) & (size - u - v >= F8(0.0f)) & (size > F8(0.0f));
  if (found.none()) {
    return found;
  }
  const F8 inverse = F8(1.0f) / size;
  const F8 t = signed_as(fused_dot(normal, to_corner)) * inverse;
  found = found & (t > min_distance) & (t < hit.distance);
  hit.distance = select(found, t, hit.distance);
  hit.u = select(found, u * inverse, hit.u);
  hit.v = select(found, v * inverse, hit.v);
  hit.normal = select(found, normal, hit.normal);
  return found;
}

/// The nearer of the points beyond `min_distance`.
M8 BruteForce::try_sphere(const Sphere& sphere, const Ray8& rays, F8 min_distance, M8 lanes, Hit8& hit) {
  const V8 center = broadcast(sphere.center);
  const F8 length2 = length_squared(rays.direction);
  const F8 closest = dot(center - rays.origin, rays.direction) / length2;
  const V8 off = rays.origin + rays.direction * closest - center;
  const F8 half2 = (F8(sphere.radius * sphere.radius) - length_squared(off)) / length2;
  const F8 half = sqrt(max(half2, F8(0.0f)));
  const F8 t = select(closest - half > min_distance, closest - half, closest + half);
  const M8 found = lanes & (half2 >= F8(0.0f)) & (t > min_distance) & (t < hit.distance);
  hit.distance = select(found, t, hit.distance);
  hit.normal = select(found, rays.origin + rays.direction * t - center, hit.normal);
  return found;
}

Hit8 BruteForce::intersect(M8 lanes, const Ray8& rays, F8 min_distance) const {
  Hit8 hit{};
  hit.distance = rays.max_distance;
  for (const Mesh& mesh : meshes_) {
    const Ray8 mapped = mesh.mapped ? to_mesh(mesh, rays) : rays;
    for (std::uint32_t i = 0; i < mesh.triangles->size(); ++i) {
      const M8 found = try_triangle((*mesh.triangles)[i], mapped, min_distance, lanes, hit);
      hit.hit = hit.hit | found;
      hit.geometry = select(found, U8(mesh.geometry), hit.geometry);
      hit.primitive = select(found, U8(i), hit.primitive);
    }
  }
  for (const Sphere& sphere : spheres_) {
    const M8 found = try_sphere(sphere, rays, min_distance, lanes, hit);
    hit.hit = hit.hit | found;
    hit.geometry = select(found, U8(sphere.geometry), hit.geometry);
    hit.primitive = select(found, U8(0u), hit.primitive);
  }
  return hit;
}

M8 BruteForce::occluded(M8 lanes, const Ray8& rays) const {
  M8 blocked;
  Hit8 hit{};
  hit.distance = rays.max_distance;
  for (const Mesh& mesh : meshes_) {
    const Ray8 mapped = mesh.mapped ? to_mesh(mesh, rays) : rays;
    for (const Triangle& triangle : *mesh.triangles) {
      blocked = blocked | try_triangle(triangle, mapped, F8(0.0f), and_not(lanes, blocked), hit);
      if (and_not(lanes, blocked).none()) {
        return blocked;
      }
    }
  }
  for (const Sphere& sphere : spheres_) {
    blocked = blocked | try_sphere(sphere, rays, F8(0.0f), lanes, hit);
  }
  return blocked;
}

}  // namespace lightmill
