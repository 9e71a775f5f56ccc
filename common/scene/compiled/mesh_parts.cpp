#include "common/scene/compiled/mesh_parts.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

namespace lightmill {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// Gives all positions in one place the same number.
std::vector<std::uint32_t> number_places(const std::vector<std::array<float, 3>>& positions) {
  std::map<std::array<float, 3>, std::uint32_t> numbers;
  std::vector<std::uint32_t> out;
  out.reserve(positions.size());
  for (const auto& p : positions) {
    out.push_back(numbers.try_emplace(p, static_cast<std::uint32_t>(numbers.size())).first->second);
  }
  return out;
}

struct Edge {
  std::uint32_t low, high;  ///< its ends
  std::uint32_t triangle;
  bool forward;  ///< the triangle goes from low to high
};

/// The edges of all triangles with three distinct corners. Repeated triangles, in either orientation, are skipped.
std::vector<Edge> edges_of(const std::vector<Triangle>& triangles, const std::vector<std::uint32_t>& place) {
  std::set<Triangle> seen;
  std::vector<Edge> edges;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle t{place[triangles[i][0]], place[triangles[i][1]], place[triangles[i][2]]};
    Triangle sorted = t;
    std::ranges::sort(sorted);
    if (sorted[0] == sorted[1] || sorted[1] == sorted[2] || !seen.insert(sorted).second) {
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), i, a < b});
    }
  }
  const auto ends = [](const Edge& e) { return std::tie(e.low, e.high, e.triangle); };
  std::ranges::sort(edges, {}, ends);
  return edges;
}

/// Growing sets of triangles. Each triangle knows whether it has the orientation of its set's root (a union-find with
/// parity).
class Sets {
 public:
  explicit Sets(std::size_t size) : parent_(size), against_(size, false) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  struct Root {
    std::uint32_t number;
    bool against;
  };
  Root root(std::uint32_t i) {
    std::uint32_t top = i;
    bool against = false;
    while (parent_[top] != top) {
      against = against != against_[top];
      top = parent_[top];
    }
    for (bool rest = against; parent_[i] != i;) {  // path compression
      const bool own = against_[i];
      against_[i] = rest;
      rest = rest != own;
      i = std::exchange(parent_[i], top);
    }
    return {top, against};
  }
  /// False if they are already joined with the opposite orientation. Roots are the smallest of their sets.
  bool join(std::uint32_t a, std::uint32_t b, bool against) {
    const Root x = root(a), y = root(b);
    const bool between = (x.against != y.against) != against;
    if (x.number == y.number) {
      return !between;
    }
    const std::uint32_t upper = std::max(x.number, y.number);
    parent_[upper] = std::min(x.number, y.number);
    against_[upper] = between;
    return true;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<bool> against_;  ///< opposite orientation to the parent
};

}  // namespace

MeshParts find_parts(const std::vector<std::array<float, 3>>& positions, const std::vector<Triangle>& triangles) {
  const std::vector<Edge> edges = edges_of(triangles, number_places(positions));
  Sets sets(triangles.size());
  std::vector<std::uint32_t> open;  // triangles with a free edge
  std::vector<bool> solid(triangles.size(), false);
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last =
        std::find_if(first, edges.end(), [&](const Edge& e) { return e.low != first->low || e.high != first->high; });
    const bool pair = last - first == 2;
    // Neighbours with the same orientation walk their edge in opposite directions.
    if (!pair || !sets.join(first->triangle, first[1].triangle, first->forward == first[1].forward)) {
      std::for_each(first, last, [&](const Edge& e) { open.push_back(e.triangle); });
    }
    std::for_each(first, last, [&](const Edge& e) { solid[e.triangle] = true; });
    first = last;
  }
  MeshParts out;
  std::vector<std::uint32_t> number(triangles.size());  // part of each root
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const Sets::Root root = sets.root(i);
    if (root.number == i) {
      number[i] = static_cast<std::uint32_t>(out.closed.size());
      out.closed.push_back(solid[i]);
    }
    out.of_triangle.push_back(number[root.number]);
    out.flipped.push_back(root.against);
  }
  for (const std::uint32_t triangle : open) {
    out.closed[out.of_triangle[triangle]] = false;
  }
  return out;
}

}  // namespace lightmill
