// Shapes of LightBuilder: spheres, triangles and parallelograms that emit.
#include <cmath>
#include <tuple>

#include "common/scene/compiled/light_builder.h"
#include "common/scene/compiled/mesh_parts.h"

namespace lightmill {
namespace {

/// A key that is equal for outlines with the same corners in the same direction, or in either direction. It begins with
/// the smallest corner. Three corners end with the first one again.
std::array<float, 12> canonical(std::vector<Vec3> outline, bool either_sense) {
  const auto less = [](const Vec3& a, const Vec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
  std::rotate(outline.begin(), std::min_element(outline.begin(), outline.end(), less), outline.end());
  if (either_sense && less(outline.back(), outline[1])) {
    std::reverse(outline.begin() + 1, outline.end());
  }
  outline.resize(4, outline.front());
  std::array<float, 12> out{};
  for (std::size_t i = 0; i < 4; ++i) {
    std::copy_n(&outline[i].x, 3, out.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  return out;
}

/// The texture of a facet. `corners` are the facet's corner and the ends of both edges, as corners of the mesh.
FacetTexture facet_texture(const Material& material, const Mesh& mesh, const std::array<std::uint32_t, 3>& corners) {
  FacetTexture out{material.emission.texture};
  if (out.number != kNoTexture && !mesh.texture_coordinates.empty()) {
    const auto& all = mesh.texture_coordinates;
    out.corner = all[corners[0]];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      out.edge1[axis] = all[corners[1]][axis] - out.corner[axis];
      out.edge2[axis] = all[corners[2]][axis] - out.corner[axis];
    }
  }
  return out;
}

/// Whether this corner of the mesh has the texture coordinates of a parallelogram's fourth corner.
bool fits_parallelogram(const FacetTexture& texture, const Mesh& mesh, std::uint32_t corner) {
  if (texture.number == kNoTexture || mesh.texture_coordinates.empty()) {
    return true;
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const float a = texture.edge1[axis], b = texture.edge2[axis];
    const float off = texture.corner[axis] + a + b - mesh.texture_coordinates[corner][axis];
    if (std::abs(off) > 1e-6f * (std::abs(texture.corner[axis]) + std::abs(a) + std::abs(b))) {
      return false;
    }
  }
  return true;
}

}  // namespace

void LightBuilder::add_other() {
  geometries_.emplace_back();
}

void LightBuilder::add_sphere(std::uint32_t material, const Vec3& center, float radius, bool inward, bool sampled) {
  Geometry& geometry = geometries_.emplace_back();
  // A sphere whose area underflows in single precision cannot be hit.
  if (!sampled || radius * radius < std::numeric_limits<float>::min()) {
    return;
  }
  const Material& m = scene_.materials[material];
  Place& place = sphere_places_[{center.x, center.y, center.z, radius, inward && !m.two_sided_emission}];
  const double scene_radius = radius / frame_.scale();
  const bool added = stand_at(place, spheres_.size(), material, 4 * kPiDouble * scene_radius * scene_radius);
  geometry.sphere = true;
  geometry.repeated = !added;
  geometry.primitives.push_back(place.number);
  if (added) {
    spheres_.push_back(
        {material, {center, radius, Vec3(0), inward, m.two_sided_emission, static_cast<float>(m.emission_exponent)}});
  }
}

/// Whether the shape is the first in its place. If so, it becomes the light of this number.
bool LightBuilder::stand_at(Place& place, std::size_t number, std::uint32_t material, double area) {
  const bool first = place.materials.empty();
  if (first) {
    place.number = static_cast<std::uint32_t>(number);
  }
  if (place.materials.insert(material).second) {
    area_[material] += area;
  }
  return first;
}

void LightBuilder::add_mesh(std::uint32_t material, const std::vector<std::array<float, 3>>& positions,
                            const Mesh& mesh, bool sampled) {
  Geometry& geometry = geometries_.emplace_back();
  if (!sampled) {
    return;
  }
  geometry.first_facet = facets_.size();
  const Material& m = scene_.materials[material];
  const MeshParts parts = m.two_sided_emission ? find_parts(positions, mesh.triangles) : MeshParts();
  const auto& triangles = mesh.triangles;
  const auto corner = [&](std::uint32_t i) { return Vec3(positions[i][0], positions[i][1], positions[i][2]); };
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = triangles[i];
    EmissiveFacet facet{corner(t[0]),
                        corner(t[1]) - corner(t[0]),
                        corner(t[2]) - corner(t[0]),
                        Vec3(0),
                        m.two_sided_emission,
                        false,
                        static_cast<float>(m.emission_exponent)};
    if (m.two_sided_emission) {
      facet.part = static_cast<std::uint32_t>(closed_parts_.size()) + parts.of_triangle[i];
      facet.flipped = parts.flipped[i];
    }
    facet.texture = facet_texture(m, mesh, t);
    std::vector<Vec3> outline{facet.corner, corner(t[1]), corner(t[2])};
    // Two consecutive triangles that are the halves (0, 1, 2) and (0, 2, 3) of a parallelogram.
    if (i + 1 < triangles.size() && triangles[i + 1][0] == t[0] && triangles[i + 1][1] == t[2]) {
      const Vec3 edge3 = corner(triangles[i + 1][2]) - facet.corner;
      const FacetTexture whole = facet_texture(m, mesh, {t[0], t[1], triangles[i + 1][2]});
      if (glm::length(facet.edge2 - facet.edge1 - edge3) <= 1e-6f * glm::length(facet.edge2) &&
          fits_parallelogram(whole, mesh, t[2])) {
        facet.edge2 = edge3;
        facet.texture = whole;
        facet.parallelogram = true;
        outline.push_back(corner(triangles[i + 1][2]));
        ++i;
      }
    }
    // A facet without area cannot be hit, so its primitives may name the next facet, or none.
    auto number = static_cast<std::uint32_t>(facets_.size());
    if (glm::length(glm::cross(facet.edge1, facet.edge2)) > 0) {
      const double area = (facet.parallelogram ? 1 : 0.5) *
                          glm::length(glm::cross(Vec3d(facet.edge1), Vec3d(facet.edge2))) /
                          (frame_.scale() * frame_.scale());
      Place& place = facet_places_[canonical(outline, m.two_sided_emission)];
      if (stand_at(place, facets_.size(), material, area)) {
        facets_.push_back({material, facet});
      }
      number = place.number;
    }
    geometry.primitives.insert(geometry.primitives.end(), outline.size() - 2, number);
  }
  geometry.end_facet = facets_.size();
  closed_parts_.insert(closed_parts_.end(), parts.closed.begin(), parts.closed.end());
}

FacetSums LightBuilder::sums_of(const Geometry& geometry) const {
  FacetSums sums;
  for (std::size_t i = geometry.first_facet; i < geometry.end_facet; ++i) {
    EmissiveFacet facet = facets_[i].shape;
    facet.radiance = Vec3(lights_.facets.mean_radiance(i));
    sums.add(facet, facet.part != EmissiveFacet::kAlone && closed_parts_[facet.part]);
  }
  return sums;
}

}  // namespace lightmill
