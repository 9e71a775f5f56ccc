#include "common/scene_io/loop_subdivision.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "common/math/vec.h"

namespace lightmill {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

struct Surface {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
};

/// An edge of one or two triangles.
struct Edge {
  int triangles = 0;
  Vec3d opposite{};  ///< sum of the triangles' third points
};

std::uint64_t directed(std::uint32_t a, std::uint32_t b) {
  return (std::uint64_t{a} << 32) | b;
}

/// Sorted by their vertices. No hash table, as a file could make its keys collide.
struct Edges {
  std::vector<std::uint64_t> keys;  ///< the smaller vertex, the larger one
  std::vector<Edge> edges;          ///< of each key

  std::size_t index(std::uint32_t a, std::uint32_t b) const {
    const auto found = std::ranges::lower_bound(keys, directed(std::min(a, b), std::max(a, b)));
    return static_cast<std::size_t>(found - keys.begin());
  }
};

Edges edges_of(const Surface& surface) {
  Edges out;
  out.keys.reserve(3 * surface.triangles.size());
  for (const Triangle& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      out.keys.push_back(directed(std::min(a, b), std::max(a, b)));
    }
  }
  std::ranges::sort(out.keys);
  out.keys.erase(std::unique(out.keys.begin(), out.keys.end()), out.keys.end());
  out.edges.resize(out.keys.size());
  for (const Triangle& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      Edge& edge = out.edges[out.index(t[k], t[(k + 1) % 3])];
      ++edge.triangles;
      edge.opposite += surface.points[t[(k + 2) % 3]];
    }
  }
  return out;
}

/// The neighbours that count for a vertex: all, or those along the boundary.
struct Ring {
  Vec3d sum{};
  int valence = 0;
  bool boundary = false;
};

std::vector<Ring> rings_of(const Surface& surface, const Edges& edges) {
  std::vector<Ring> out(surface.points.size());
  const auto add = [&](std::uint32_t to, std::uint32_t neighbour) {
    out[to].sum += surface.points[neighbour];
    ++out[to].valence;
  };
  for (std::size_t i = 0; i < edges.keys.size(); ++i) {
    if (edges.edges[i].triangles == 1) {
      out[edges.keys[i] >> 32].boundary = out[edges.keys[i] & 0xffffffff].boundary = true;
    }
  }
  for (const Triangle& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const bool on_boundary = edges.edges[edges.index(a, b)].triangles == 1;
      if (on_boundary || !out[a].boundary) {
        add(a, b);
      }
      if (on_boundary) {
        add(b, a);
      }
    }
  }
  return out;
}

Vec3d weighted(const Vec3d& point, const Ring& ring, double weight) {
  return (1 - ring.valence * weight) * point + weight * ring.sum;
}

double beta(int valence) {
  return valence == 3 ? 3.0 / 16 : 3.0 / (8 * valence);
}

Surface subdivided(const Surface& from) {
  const Edges edges = edges_of(from);
  const std::vector<Ring> rings = rings_of(from, edges);
  const auto even = static_cast<std::uint32_t>(from.points.size());
  Surface out;
  out.points.resize(even + edges.keys.size());
  for (std::uint32_t i = 0; i < even; ++i) {
    const Ring& ring = rings[i];
    out.points[i] = ring.valence == 0 ? from.points[i]
                                      : weighted(from.points[i], ring, ring.boundary ? 1.0 / 8 : beta(ring.valence));
  }
  for (std::size_t i = 0; i < edges.keys.size(); ++i) {
    const Edge& edge = edges.edges[i];
    const Vec3d ends = from.points[edges.keys[i] >> 32] + from.points[edges.keys[i] & 0xffffffff];
    out.points[even + i] = edge.triangles == 1 ? 0.5 * ends : 3.0 / 8 * ends + 1.0 / 8 * edge.opposite;
  }
  out.triangles.reserve(4 * from.triangles.size());
  for (const Triangle& t : from.triangles) {
    Triangle middle{};
    for (std::size_t k = 0; k < 3; ++k) {
      middle[k] = even + static_cast<std::uint32_t>(edges.index(t[k], t[(k + 1) % 3]));
    }
    for (std::size_t k = 0; k < 3; ++k) {
      out.triangles.push_back({t[k], middle[k], middle[(k + 2) % 3]});
    }
    out.triangles.push_back(middle);
  }
  return out;
}

/// The neighbours of each vertex, counter-clockwise. Those of a boundary begin and end with its own.
std::vector<std::vector<std::uint32_t>> ordered_neighbours(const Surface& surface) {
  std::vector<std::vector<std::array<std::uint32_t, 2>>> sides(surface.points.size());
  for (const Triangle& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      sides[t[k]].push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
    }
  }
  std::vector<std::vector<std::uint32_t>> out(sides.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    std::map<std::uint32_t, std::uint32_t> next;
    std::set<std::uint32_t> ends;
    for (const auto& [from, to] : sides[i]) {
      next.emplace(from, to);
      ends.insert(to);
    }
    const auto begins = [&](const auto& side) { return !ends.contains(side[0]); };
    const auto first = std::ranges::find_if(sides[i], begins);
    auto at = next.find(first != sides[i].end() ? (*first)[0] : sides[i].empty() ? 0 : sides[i][0][0]);
    while (at != next.end()) {
      out[i].push_back(at->first);
      const std::uint32_t to = at->second;
      next.erase(at);
      at = next.find(to);
      if (at == next.end() && to != out[i].front()) {
        out[i].push_back(to);  // the end of a boundary
      }
    }
  }
  return out;
}

/// Clockwise, as in pbrt. `ring` is ordered.
Vec3d normal_of(const Vec3d& point, const std::vector<Vec3d>& ring, bool boundary) {
  using std::numbers::pi;
  const std::size_t n = ring.size();
  Vec3d s{}, t{};
  if (!boundary) {
    for (std::size_t j = 0; j < n; ++j) {
      const double angle = 2 * pi * static_cast<double>(j) / static_cast<double>(n);
      s += std::cos(angle) * ring[j];
      t += std::sin(angle) * ring[j];
    }
    return glm::cross(t, s);
  }
  s = ring[n - 1] - ring[0];
  if (n == 2) {
    t = ring[0] + ring[1] - 2.0 * point;
  } else if (n == 3) {
    t = ring[1] - point;
  } else if (n == 4) {
    t = -ring[0] + 2.0 * ring[1] + 2.0 * ring[2] - ring[3] - 2.0 * point;
  } else {
    const double angle = pi / static_cast<double>(n - 1);
    t = -std::sin(angle) * (ring[0] + ring[n - 1]);
    for (std::size_t k = 1; k + 1 < n; ++k) {
      t -= (2 * std::cos(angle) - 2) * std::sin(static_cast<double>(k) * angle) * ring[k];
    }
  }
  return glm::cross(s, t);
}

/// Each edge has one triangle on each side, or one at all.
Status check_manifold(const Mesh& mesh) {
  std::vector<std::uint64_t> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (t[k] == t[(k + 1) % 3]) {
        return invalid_argument("a triangle has vertex {} twice", t[k]);
      }
      edges.push_back(directed(t[k], t[(k + 1) % 3]));
    }
  }
  std::ranges::sort(edges);
  const auto twice = std::ranges::adjacent_find(edges);
  return twice == edges.end()
             ? ok_status()
             : invalid_argument("the edge from vertex {} to {} belongs to two triangles of the same side", *twice >> 32,
                                *twice & 0xffffffff);
}

}  // namespace

Result<Mesh> loop_subdivision(const Mesh& base, int levels) {
  LM_RETURN_IF_ERROR(check_manifold(base));
  Surface surface;
  surface.triangles = base.triangles;
  for (const auto& p : base.positions) {
    surface.points.emplace_back(p[0], p[1], p[2]);
  }
  for (int i = 0; i < levels; ++i) {
    surface = subdivided(surface);
  }

  const Edges edges = edges_of(surface);
  const std::vector<Ring> rings = rings_of(surface, edges);
  Surface limit = surface;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Ring& ring = rings[i];
    if (ring.valence > 0) {
      const double weight = ring.boundary ? 1.0 / 5 : 1 / (ring.valence + 3 / (8 * beta(ring.valence)));
      limit.points[i] = weighted(surface.points[i], ring, weight);
    }
  }
  Mesh out;
  out.triangles = std::move(limit.triangles);
  const std::vector<std::vector<std::uint32_t>> neighbours = ordered_neighbours(surface);
  for (std::size_t i = 0; i < limit.points.size(); ++i) {
    const Vec3d& p = limit.points[i];
    out.positions.push_back({p.x, p.y, p.z});
    std::vector<Vec3d> ring;
    for (const std::uint32_t neighbour : neighbours[i]) {
      ring.push_back(limit.points[neighbour]);
    }
    const Vec3d normal = ring.size() < 2 ? Vec3d(0, 0, 1) : normal_of(p, ring, rings[i].boundary);
    const double length = glm::length(normal);
    const Vec3d unit = length > 1e-300 ? normal / length : Vec3d(0, 0, 1);
    out.normals.push_back({static_cast<float>(unit.x), static_cast<float>(unit.y), static_cast<float>(unit.z)});
  }
  return out;
}

}  // namespace lightmill
