#include "common/lights/facet_irradiance.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/lights/closed_form_irradiance.h"

namespace lightmill {
namespace {

/// Facets farther than this multiple of their extent count as points.
constexpr float kFarRadii = 32;

M8 one_lane(int lane) {
  return U8::lane_index() == U8(static_cast<std::uint32_t>(lane));
}

/// Form factor of a facet of unit radiance, seen from p on either side (Lambert's formula).
double form_factor(const EmissiveFacet& facet, const Vec3d& p, const Vec3d& n) {
  const Vec3d corner = Vec3d(facet.corner) - p, edge1(facet.edge1), edge2(facet.edge2);
  std::array<Vec3d, 4> corners{corner, corner + edge1, corner + edge1 + edge2, corner + edge2};
  std::size_t count = 4;
  if (!facet.parallelogram) {
    corners[2] = corners[3];
    count = 3;
  }
  return polygon_irradiance(std::span(corners).first(count), n);
}

struct Sides {
  F8 front{0.0f}, back{0.0f};  ///< irradiance for unit radiance, from facets that face the surface, and from the others
};

struct Surface {
  explicit Surface(const V8& at, const V8& normal) : p(at), n(normal), points(at), normals(normal) {}
  V8 p, n;
  VectorLanes points, normals;
};

Sides sides_of(const EmissiveFacet& facet, const Surface& surface, M8 lanes) {
  const Vec3 to_middle = (facet.edge1 + facet.edge2) * (facet.parallelogram ? 0.5f : 1.0f / 3);
  const Vec3 area_vector = glm::cross(facet.edge1, facet.edge2) * (facet.parallelogram ? 1.0f : 0.5f);
  const V8 way = broadcast(facet.corner + to_middle) - surface.p;
  const F8 radius(glm::length(facet.edge1) + glm::length(facet.edge2));
  const F8 height = dot(way, surface.n), facing = -dot(way, broadcast(area_vector));
  const M8 front = facing > F8(0.0f);
  M8 seen = lanes & (height > -radius) & (front | (facing < F8(0.0f)));
  seen = facet.two_sided ? seen : seen & front;
  if (seen.none()) {
    return {};
  }
  const F8 distance2 = length_squared(way);
  const M8 far = seen & (distance2 > F8(kFarRadii * kFarRadii) * radius * radius) & (height > radius);
  F8 value = select(far, abs(facing) * height / (distance2 * distance2), F8(0.0f));
  for (unsigned bits = static_cast<unsigned>(and_not(seen, far).bits()); bits != 0; bits &= bits - 1) {
    const int lane = std::countr_zero(bits);
    const auto near = static_cast<float>(form_factor(facet, surface.points[lane], surface.normals[lane]));
    value = select(one_lane(lane), F8(near), value);
  }
  return {select(front, value, F8(0.0f)), select(front, F8(0.0f), value)};
}

}  // namespace

FacetIrradiance::FacetIrradiance(const FacetLights& facets) {
  facets_.reserve(facets.size());
  for (std::size_t i = 0; i < facets.size(); ++i) {
    facets_.push_back(facets.facet(i));
  }
  std::ranges::stable_sort(facets_, {}, &EmissiveFacet::part);
}

V8 FacetIrradiance::at(const V8& p, const V8& n, M8 lanes) const {
  const Surface surface(p, n);
  V8 sum;
  Sides part;
  for (std::size_t i = 0; i < facets_.size(); ++i) {
    const EmissiveFacet& facet = facets_[i];
    const Sides of = sides_of(facet, surface, lanes);
    part.front = part.front + (facet.flipped ? of.back : of.front);
    part.back = part.back + (facet.flipped ? of.front : of.back);
    if (facet.part == EmissiveFacet::kAlone || i + 1 == facets_.size() || facets_[i + 1].part != facet.part) {
      sum = sum + broadcast(facet.radiance) * max(part.front, part.back);
      part = {};
    }
  }
  return sum;
}

}  // namespace lightmill
