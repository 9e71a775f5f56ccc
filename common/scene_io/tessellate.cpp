#include "common/scene_io/tessellate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lightmill {
namespace {

struct Arc {
  double radians;
  std::uint32_t steps;

  explicit Arc(double degrees)
      : radians(degrees * std::numbers::pi / 180),
        steps(std::max(3u, static_cast<std::uint32_t>(std::ceil(kCircleSteps * degrees / 360)))) {}
  double step() const { return radians / steps; }
};

}  // namespace

Mesh tessellate(const Surface& surface, std::uint32_t across, std::uint32_t along, bool smooth) {
  Mesh out;
  for (std::uint32_t j = 0; j <= along; ++j) {
    for (std::uint32_t i = 0; i <= across; ++i) {
      const double u = static_cast<double>(i) / across, v = static_cast<double>(j) / along;
      const PatchPoint point = surface(u, v);
      out.positions.push_back(point.position);
      if (smooth) {
        const auto& n = point.normal;
        out.normals.push_back({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
      }
      out.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(v)});
      if (i < across && j < along) {
        const std::uint32_t corner = j * (across + 1) + i, above = corner + across + 1;
        out.triangles.push_back({corner, corner + 1, above + 1});
        out.triangles.push_back({corner, above + 1, above});
      }
    }
  }
  return out;
}

Mesh disk_mesh(double inner_radius, double degrees) {
  const Arc arc(degrees);
  // A triangle with two sides r has the area r² sin(step) / 2, and its sector r² step / 2.
  const double wider = std::sqrt(arc.step() / std::sin(arc.step()));
  return tessellate(
      [&](double u, double v) -> PatchPoint {
        const double angle = u * arc.radians, radius = wider * (1 - v * (1 - inner_radius));
        return {{radius * std::cos(angle), radius * std::sin(angle), 0}, {0, 0, 1}};
      },
      arc.steps, 1, false);
}

Mesh cylinder_mesh(double degrees) {
  const Arc arc(degrees);
  const double wider = arc.step() / (2 * std::sin(arc.step() / 2));  // a chord's length
  return tessellate(
      [&](double u, double v) -> PatchPoint {
        const double x = std::cos(u * arc.radians), y = std::sin(u * arc.radians);
        return {{wider * x, wider * y, v}, {x, y, 0}};
      },
      arc.steps, 1, true);
}

Mesh sphere_mesh(double z_low, double z_high, double degrees) {
  const Arc arc(degrees);
  const double low = std::asin(z_low), high = std::asin(z_high);
  const Arc height((high - low) * 180 / std::numbers::pi);
  return tessellate(
      [&](double u, double v) -> PatchPoint {
        const double angle = u * arc.radians, latitude = low + v * (high - low);
        const std::array<double, 3> p{std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle),
                                      std::sin(latitude)};
        return {p, p};
      },
      arc.steps, height.steps, true);
}

}  // namespace lightmill
