#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

Surface8 CompiledScene::surface(const Ray8& rays, const Hit8& hits) const {
  const M8 lanes = hits.hit;
  Surface8 s;
  s.material = gather(geometry_material_.data(), hits.geometry, lanes);
  s.point = rays.origin + rays.direction * hits.distance;
  s.geometric_normal = normalize(hits.normal);
  // What a coordinate of the hit may be off by grows with itself, with the ray's way to it and with the way from the
  // ray to the triangle's corners.
  const U8 triangle = gather(geometry_triangles_.data(), hits.geometry, lanes) + hits.primitive;
  V8 magnitude = abs(s.point) + abs(rays.direction) * hits.distance + gather3(triangle_extent_.data(), triangle, lanes);

  if (features_.spheres) {
    const M8 sphere = lanes & (gather(geometry_is_sphere_.data(), hits.geometry, lanes) == U8(1u));
    if (sphere.any()) {
      // Put the point back onto the sphere: what the ray's length has cost in accuracy is gone then.
      const V8 center = gather3(sphere_center_.data(), hits.geometry, sphere);
      const F8 radius = gather(sphere_radius_.data(), hits.geometry, sphere);
      const V8 outward = normalize(s.point - center);
      s.point = select(sphere, center + outward * radius, s.point);
      magnitude = select(sphere, abs(s.point) + V8{radius, radius, radius}, magnitude);
      const M8 inward = gather(geometry_inward_.data(), hits.geometry, sphere) == U8(1u);
      s.geometric_normal = select(sphere, select(inward, -outward, outward), s.geometric_normal);
    }
  }
  s.front = lanes & (dot(rays.direction, s.geometric_normal) < F8(0.0f));
  s.offset = surface_offset(s.geometric_normal, magnitude);
  s.shading_normal = s.geometric_normal;

  if (features_.smooth) {
    const M8 smooth = lanes & (gather(geometry_smooth_.data(), hits.geometry, lanes) == U8(1u));
    if (smooth.any()) {
      const U8 corners = gather(geometry_smooth_triangles_.data(), hits.geometry, smooth) + hits.primitive;
      const U8 first = corners + corners + corners;
      const V8 n0 = gather3(vertex_normals_.data(), gather(smooth_triangles_.data(), first, smooth), smooth);
      const V8 n1 = gather3(vertex_normals_.data(), gather(smooth_triangles_.data(), first + U8(1u), smooth), smooth);
      const V8 n2 = gather3(vertex_normals_.data(), gather(smooth_triangles_.data(), first + U8(2u), smooth), smooth);
      V8 n = n0 * (F8(1.0f) - hits.u - hits.v) + n1 * hits.u + n2 * hits.v;
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

M8 CompiledScene::emits(const Surface8& surface, M8 lanes) const {
  const U8 sides = gather(material_emits_.data(), surface.material, lanes);
  return lanes & (((sides == U8(1u)) & surface.front) | (sides == U8(2u)));
}

F8 CompiledScene::light_pdf_solid_angle(const V8& from, const Hit8& hits, F8 cos_light, M8 lanes) const {
  const F8 pdf_area = gather(emitter_pdf_area_.data(), hits.geometry, lanes);
  F8 pdf = pdf_area * hits.distance * hits.distance / cos_light;
  if (features_.spheres) {
    const M8 sphere = lanes & (gather(geometry_is_sphere_.data(), hits.geometry, lanes) == U8(1u));
    if (sphere.any()) {
      const V8 center = gather3(sphere_center_.data(), hits.geometry, sphere);
      const F8 radius = gather(sphere_radius_.data(), hits.geometry, sphere);
      const F8 probability = gather(emitter_probability_.data(), hits.geometry, sphere);
      pdf = select(sphere, probability * sphere_pdf_solid_angle(from, center, radius, hits.distance, cos_light), pdf);
    }
  }
  return pdf;
}

}  // namespace lightmill
