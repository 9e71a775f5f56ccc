#include "common/scene_io/polygon.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Most steps for one polygon: visits of a corner, and tests of a corner against a candidate ear. Outlines that need
/// more would take too long. A star takes 500 for each of 16,000 corners, a comb 800.
std::uint64_t most_steps(std::size_t corners) {
  return 100'000 + std::uint64_t{2'000} * corners;
}

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

/// The reflex corners of an outline, in a grid over it, so that only those near an ear are tested.
class ReflexCorners {
 public:
  explicit ReflexCorners(const std::vector<Point2>& points) : points_(points), reflex_(points.size()) {
    low_ = high_ = points[0];
    for (const Point2& p : points) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
      high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y)};
    }
  }

  void add(std::uint32_t corner) {
    reflex_[corner] = true;
    corners_.push_back(corner);
    ++count_;
  }
  /// Call it after the last add().
  void sort() {
    std::erase_if(corners_, [&](std::uint32_t corner) { return !reflex_[corner]; });
    side_ = std::max(1u, static_cast<std::uint32_t>(std::sqrt(static_cast<double>(corners_.size()))));
    begins_.assign(std::size_t{side_} * side_ + 1, 0);
    for (const std::uint32_t corner : corners_) {
      ++begins_[cell(corner) + 1];
    }
    for (std::size_t i = 1; i < begins_.size(); ++i) {
      begins_[i] += begins_[i - 1];
    }
    std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1), sorted(corners_.size());
    for (const std::uint32_t corner : corners_) {
      sorted[next[cell(corner)]++] = corner;
    }
    corners_ = std::move(sorted);
  }
  /// Whether it was one.
  bool remove(std::uint32_t corner) {
    if (!reflex_[corner]) {
      return false;
    }
    reflex_[corner] = false;
    if (--count_ < corners_.size() / 2) {
      sort();
    }
    return true;
  }
  bool has(std::uint32_t corner) const { return reflex_[corner]; }

  /// One of those in a box for which `test` holds. Nothing if there is none. Adds the work to `steps`.
  template <class Test>
  std::optional<std::uint32_t> find(const Point2& low, const Point2& high, std::uint64_t& steps,
                                    const Test& test) const {
    const std::uint32_t left = column(low.x), right = column(high.x), bottom = row(low.y), top = row(high.y);
    for (std::uint32_t y = bottom; y <= top; ++y) {
      const std::uint32_t begin = begins_[y * side_ + left], end = begins_[y * side_ + right + 1];
      steps += 1 + end - begin;
      for (std::uint32_t i = begin; i < end; ++i) {
        if (reflex_[corners_[i]] && test(corners_[i])) {
          return corners_[i];
        }
      }
    }
    return std::nullopt;
  }

 private:
  std::uint32_t place(double at, double low, double high) const {
    const double part = (at - low) / (high - low) * side_;
    return part > 0 ? static_cast<std::uint32_t>(std::min(part, side_ - 1.0)) : 0;  // NaN: 0
  }
  std::uint32_t column(double x) const { return place(x, low_.x, high_.x); }
  std::uint32_t row(double y) const { return place(y, low_.y, high_.y); }
  std::size_t cell(std::uint32_t corner) const {
    return std::size_t{row(points_[corner].y)} * side_ + column(points_[corner].x);
  }

  const std::vector<Point2>& points_;
  std::vector<bool> reflex_;            ///< by corner
  std::vector<std::uint32_t> corners_;  ///< by cell, with some that are no longer reflex
  std::vector<std::uint32_t> begins_;   ///< of each cell in corners_, and the end
  std::size_t count_ = 0;
  std::uint32_t side_ = 1;  ///< cells along each axis
  Point2 low_, high_;       ///< the outline's box
};

/// Cuts ears off an outline, which is a ring of the remaining corners.
class EarCutter {
 public:
  EarCutter(const std::vector<Point2>& points, std::vector<std::array<std::uint32_t, 3>>& triangles)
      : points_(points), triangles_(triangles), reflex_(points), within_(points.size()), left_(points.size()) {
    const auto count = static_cast<std::uint32_t>(points.size());
    previous_.reserve(count);
    next_.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      previous_.push_back(i == 0 ? count - 1 : i - 1);
      next_.push_back(i + 1 == count ? 0 : i + 1);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      if (area_at(i) < 0) {
        reflex_.add(i);
      }
    }
    reflex_.sort();
  }

  bool run() {
    const std::uint64_t most = most_steps(points_.size());
    std::uint32_t first = 0, at = 0;     // of the corners that may be ears
    std::size_t candidates = left_ - 1;  // without `at`
    while (left_ > 3 && steps_ < most) {
      ++steps_;
      if (is_ear(at)) {
        cut(at);
        first = at = previous_[at];
        candidates = left_ - 1;
      } else if (candidates > 0) {
        --candidates;
        at = next_[at];
      } else if (const std::optional<std::uint32_t> flat = find_flat(previous_[first])) {
        // The only ears left are corners on an edge, or spikes. They cover nothing. Removing one changes only its
        // neighbours, unless one of these was a reflex corner.
        const bool all_change = remove(*flat);
        first = at = previous_[*flat];
        candidates = all_change ? left_ - 1 : 1;
      } else {
        at = previous_[first];  // the last one of a whole turn
        break;
      }
    }
    const bool all = left_ == 3 && area_at(at) >= -1e-9 * outline_area();
    const std::uint32_t tip = at;
    for (std::uint32_t i = next_[tip]; next_[i] != tip; i = next_[i]) {
      triangles_.push_back({tip, i, next_[i]});
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
    const Point2 low{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})};
    const Point2 high{std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})};
    const auto is_within = [&](std::uint32_t k) {
      const Point2& p = points_[k];
      return !(p == a || p == b || p == c) && doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 &&
             doubled_area(c, a, p) >= 0;
    };
    std::optional<std::uint32_t>& found = within_[i];  // it often still is
    if (!found || !reflex_.has(*found) || !is_within(*found)) {
      found = reflex_.find(low, high, steps_, is_within);
    }
    return !found;
  }

  std::optional<std::uint32_t> find_flat(std::uint32_t start) {
    std::uint32_t i = start;
    do {
      ++steps_;
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

  /// Whether the set of reflex corners changes.
  bool remove(std::uint32_t i) {
    next_[previous_[i]] = next_[i];
    previous_[next_[i]] = previous_[i];
    --left_;
    bool changed = reflex_.remove(i);
    for (const std::uint32_t neighbour : {previous_[i], next_[i]}) {  // only their angles have changed
      if (reflex_.has(neighbour) && area_at(neighbour) >= 0) {
        changed = reflex_.remove(neighbour) || changed;
      }
    }
    return changed;
  }

  const std::vector<Point2>& points_;
  std::vector<std::array<std::uint32_t, 3>>& triangles_;
  std::vector<std::uint32_t> previous_, next_;
  ReflexCorners reflex_;
  std::vector<std::optional<std::uint32_t>> within_;  ///< by corner: the reflex corner that was within its triangle
  std::size_t left_;
  std::uint64_t steps_ = 0;
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
