// Affine maps and views of scene files.
#pragma once

#include <optional>

#include "common/scene/document.h"

namespace lightmill {

/// a after b.
Transform compose(const Transform& a, const Transform& b);
Transform translation(const Point3d& by);
Transform scaling(const Point3d& by);
/// About an axis through the origin, counter-clockwise when the axis points to the viewer. The axis must not be zero.
Transform rotation(double degrees, const Point3d& axis);
/// Nothing if the map flattens space (spans_space).
std::optional<Transform> inverse(const Transform& t);
double determinant(const Transform& t);
Point3d map_point(const Transform& t, const Point3d& p);
Point3d map_vector(const Transform& t, const Point3d& v);
/// The factor of all lengths, if the map has one to a relative error of 1e-4.
std::optional<double> similarity_scale(const Transform& t);
/// Rows of the matrix that takes directions of the scene to an object's own ones. Nothing if `to_scene` is no similarity.
/// It may mirror.
std::optional<std::array<Point3d, 3>> orientation_of(const Transform& to_scene);

/// The map of an object at `eye` whose +z points to `at` and whose +y points towards `up`: x is y × z. Nothing if the
/// points are one, or `up` is along the view.
std::optional<Transform> looking_at(const Point3d& eye, const Point3d& at, const Point3d& up);

/// The map that mirrors x.
inline constexpr Transform kMirrorX{{{-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

/// The eye, target and up direction of a camera. `to_scene` maps its own coordinates, in which it is at the origin,
/// looks along +z, and +y is up. The rest has defaults.
Camera camera_along_z(const Transform& to_scene);

}  // namespace lightmill
