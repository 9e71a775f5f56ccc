#include "common/scene_io/polygon.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Limit of tests of one polygon's corners against its candidate ears. Outlines that need more would take too long.
constexpr std::uint64_t kMaxTests = 50'000'000;

struct Point2 {
  double x = 0, y = 0;
  friend bool operator==(const Point2&, const Point2&) = default;
};

/// Twice the signed area of a triangle. Positive if it is counter-clockwise.
double doubled_area(const Point2& a, const Point2& b, const Point2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The corners without the axis that the polygon faces most, so that the outline is counter-clockwise. The components
/// of Newell's normal are the doubled areas of the outline's projections (Sutherland, Sproull and Schumacker 1974).
std::vector<Point2> project(std::span<const std::array<double, 3>> corners) {
  std::array<double, 3> normal{};
  const auto& origin = corners[0];
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& p = corners[i];
    const auto& q = corners[(i + 1) % corners.size()];
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      normal[axis] += (p[u] - origin[u]) * (q[v] - origin[v]) - (p[v] - origin[v]) * (q[u] - origin[u]);
    }
  }
  int drop = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (std::abs(normal[axis]) > std::abs(normal[drop])) {
      drop = axis;
    }
  }
  const int u = (drop + 1) % 3, v = (drop + 2) % 3;
  const double sign = normal[drop] < 0 ? -1 : 1;
  std::vector<Point2> out;
  out.reserve(corners.size());
  for (const auto& p : corners) {
    out.push_back({sign * (p[u] - origin[u]), p[v] - origin[v]});
  }
  return out;
}

bool fan_covers(const std::vector<Point2>& points) {
  for (std::size_t i = 2; i < points.size(); ++i) {
    if (doubled_area(points[0], points[i - 1], points[i]) < 0) {
      return false;
    }
  }
  return true;
}

/// Cuts ears off an outline, which is a ring of the remaining corners.
class EarCutter {
 public:
  EarCutter(const std::vector<Point2>& points, std::vector<std::array<std::uint32_t, 3>>& triangles)
      : points_(points), triangles_(triangles), left_(points.size()) {
    const auto count = static_cast<std::uint32_t>(points.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      previous_.push_back(i == 0 ? count - 1 : i - 1);
      next_.push_back(i + 1 == count ? 0 : i + 1);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      if (area_at(i) < 0) {
        reflex_.push_back(i);
      }
    }
  }

  bool run() {
    std::uint32_t at = 0;
    std::size_t tried = 0;
    while (left_ > 3 && tests_ < kMaxTests) {
      if (is_ear(at)) {
        cut(at);
        at = previous_[at];
        tried = 0;
      } else if (++tried < left_) {
        at = next_[at];
      } else if (const std::optional<std::uint32_t> flat = find_flat(at)) {
        remove(*flat);  // the only ears left are corners on an edge, or spikes: they cover nothing
        at = previous_[*flat];
        tried = 0;
      } else {
        break;
      }
    }
    const bool all = left_ == 3 && area_at(at) >= -1e-9 * outline_area();
    const std::uint32_t first = at;
    for (std::uint32_t i = next_[first]; next_[i] != first; i = next_[i]) {
      triangles_.push_back({first, i, next_[i]});
    }
    return all;
  }

 private:
  double area_at(std::uint32_t i) const { return doubled_area(points_[previous_[i]], points_[i], points_[next_[i]]); }

  double outline_area() const {
    double area = 0;
    for (std::size_t i = 2; i < points_.size(); ++i) {
      area += doubled_area(points_[0], points_[i - 1], points_[i]);
    }
    return area;
  }

  bool is_ear(std::uint32_t i) {
    if (!(area_at(i) > 0)) {
      return false;
    }
    const Point2 &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
    tests_ += reflex_.size();
    return std::none_of(reflex_.begin(), reflex_.end(), [&](std::uint32_t k) {
      const Point2& p = points_[k];
      return !(p == a || p == b || p == c) && doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 &&
             doubled_area(c, a, p) >= 0;
    });
  }

  std::optional<std::uint32_t> find_flat(std::uint32_t start) const {
    std::uint32_t i = start;
    do {
      if (area_at(i) == 0) {
        return i;
      }
      i = next_[i];
    } while (i != start);
    return std::nullopt;
  }

  void cut(std::uint32_t i) {
    triangles_.push_back({previous_[i], i, next_[i]});
    remove(i);
  }

  void remove(std::uint32_t i) {
    next_[previous_[i]] = next_[i];
    previous_[next_[i]] = previous_[i];
    --left_;
    // Only the neighbours' angles have changed.
    std::erase_if(reflex_,
                  [&](std::uint32_t k) { return k == i || ((k == previous_[i] || k == next_[i]) && area_at(k) >= 0); });
  }

  const std::vector<Point2>& points_;
  std::vector<std::array<std::uint32_t, 3>>& triangles_;
  std::vector<std::uint32_t> previous_, next_;
  std::vector<std::uint32_t> reflex_;
  std::size_t left_;
  std::uint64_t tests_ = 0;
};

}  // namespace

bool triangulate(std::span<const std::array<double, 3>> corners, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  LM_CHECK(corners.size() >= 3, "a polygon of {} corners", corners.size());
  if (corners.size() > 3) {
    const std::vector<Point2> points = project(corners);
    if (!fan_covers(points)) {
      return EarCutter(points, triangles).run();
    }
  }
  for (std::uint32_t i = 2; i < corners.size(); ++i) {
    triangles.push_back({0, i - 1, i});
  }
  return true;
}

}  // namespace lightmill
