#include <cmath>
#include <numbers>

#include "common/base/overloaded.h"
#include "common/scene/validate/validate.h"
#include "common/wire/scene_parts.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {
namespace {

/// The linear part of a transform: three rows of three.
using Linear = std::array<std::array<double, 3>, 3>;

/// A rotation about a unit axis, counter-clockwise when the axis points to the viewer. Rodrigues' formula.
Linear rotation(const Point3d& axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const double c = std::cos(angle), s = std::sin(angle), d = 1 - c;
  const auto& [x, y, z] = axis;
  return {{{c + d * x * x, d * x * y - s * z, d * x * z + s * y},
           {d * x * y + s * z, c + d * y * y, d * y * z - s * x},
           {d * x * z - s * y, d * y * z + s * x, c + d * z * z}}};
}

Result<Transform> matrix_from_wire(const std::string& path, const v1::Transform& transform) {
  if (transform.matrix_size() != 16) {
    return invalid_argument("{}.matrix: 16 numbers are expected, got {}", path, transform.matrix_size());
  }
  if (transform.has_scale() || transform.has_rotate() || transform.has_translate()) {
    return invalid_argument("{}: give either matrix, or scale, rotate and translate", path);
  }
  Transform out;
  for (int i = 0; i < 12; ++i) {
    out[static_cast<std::size_t>(i / 4)][static_cast<std::size_t>(i % 4)] = transform.matrix(i);
  }
  if (transform.matrix(12) != 0 || transform.matrix(13) != 0 || transform.matrix(14) != 0 ||
      transform.matrix(15) != 1) {
    return invalid_argument("{}.matrix: the last row must be 0, 0, 0, 1, got {}, {}, {}, {}", path,
                            transform.matrix(12), transform.matrix(13), transform.matrix(14), transform.matrix(15));
  }
  return out;
}

Result<Transform> transform_from_wire(const std::string& path, const v1::Transform& transform) {
  if (transform.matrix_size() > 0) {
    return matrix_from_wire(path, transform);
  }
  Linear linear{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  if (transform.has_rotate()) {
    LM_ASSIGN_OR_RETURN(const Point3d axis, point_from_wire(path + ".rotate.axis", transform.rotate().has_axis(),
                                                            transform.rotate().axis()));
    LM_RETURN_IF_ERROR(check_direction(path + ".rotate.axis", axis));
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    linear = rotation({axis[0] / length, axis[1] / length, axis[2] / length}, transform.rotate().degrees());
  }
  Point3d scale{1, 1, 1};
  if (transform.has_scale()) {
    scale = {transform.scale().x(), transform.scale().y(), transform.scale().z()};
  }
  const Point3d move{transform.translate().x(), transform.translate().y(), transform.translate().z()};
  Transform out;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      out[row][column] = linear[row][column] * scale[column];
    }
    out[row][3] = move[row];
  }
  return out;
}

Status shape_from_wire(const std::string& path, const v1::Object& object, Object& out) {
  switch (object.shape_case()) {
    case v1::Object::kMesh: {
      if (object.mesh().file().empty() && object.mesh().asset().empty()) {
        return invalid_argument("{}.mesh.file: must be given", path);
      }
      out.shape = MeshShape{object.mesh().file(), {}};
      return ok_status();
    }
    case v1::Object::kSphere: {
      SphereShape sphere;
      LM_ASSIGN_OR_RETURN(sphere.center, point_from_wire(path + ".sphere.center", object.sphere().has_center(),
                                                         object.sphere().center()));
      sphere.radius = object.sphere().radius();
      sphere.normal_inward = object.sphere().normal_inward();
      out.shape = sphere;
      return ok_status();
    }
    case v1::Object::kPlane: {
      const v1::Object::Plane& wire = object.plane();
      PlaneShape plane;
      LM_ASSIGN_OR_RETURN(plane.point, point_from_wire(path + ".plane.point", wire.has_point(), wire.point()));
      LM_ASSIGN_OR_RETURN(plane.normal, point_from_wire(path + ".plane.normal", wire.has_normal(), wire.normal()));
      out.shape = plane;
      return ok_status();
    }
    case v1::Object::kTriangle: {
      const v1::Object::Triangle& wire = object.triangle();
      TriangleShape triangle;
      LM_ASSIGN_OR_RETURN(triangle.a, point_from_wire(path + ".triangle.a", wire.has_a(), wire.a()));
      LM_ASSIGN_OR_RETURN(triangle.b, point_from_wire(path + ".triangle.b", wire.has_b(), wire.b()));
      LM_ASSIGN_OR_RETURN(triangle.c, point_from_wire(path + ".triangle.c", wire.has_c(), wire.c()));
      out.shape = triangle;
      return ok_status();
    }
    case v1::Object::SHAPE_NOT_SET:
      break;
  }
  return invalid_argument("{}: a shape must be given. The shapes are mesh, sphere, plane, triangle", path);
}

void to_wire_shape(const Object& object, v1::Object* out) {
  std::visit(Overloaded{[&](const MeshShape& mesh) {
                          out->mutable_mesh()->set_file(mesh.file);
                          out->mutable_mesh()->set_asset(mesh.asset.hex());
                        },
                        [&](const SphereShape& sphere) {
                          to_wire_point(sphere.center, out->mutable_sphere()->mutable_center());
                          out->mutable_sphere()->set_radius(sphere.radius);
                          out->mutable_sphere()->set_normal_inward(sphere.normal_inward);
                        },
                        [&](const PlaneShape& plane) {
                          to_wire_point(plane.point, out->mutable_plane()->mutable_point());
                          to_wire_point(plane.normal, out->mutable_plane()->mutable_normal());
                        },
                        [&](const TriangleShape& triangle) {
                          to_wire_point(triangle.a, out->mutable_triangle()->mutable_a());
                          to_wire_point(triangle.b, out->mutable_triangle()->mutable_b());
                          to_wire_point(triangle.c, out->mutable_triangle()->mutable_c());
                        }},
             object.shape);
}

}  // namespace

void to_wire_object(const Object& object, const std::vector<Material>& materials, v1::Object* out) {
  out->set_name(object.name);
  out->set_material(materials[object.material].name);
  to_wire_shape(object, out);
  if (object.transform != kIdentityTransform) {
    v1::Transform* transform = out->mutable_transform();
    for (const auto& row : object.transform) {
      transform->mutable_matrix()->Add(row.begin(), row.end());
    }
    for (const double value : {0.0, 0.0, 0.0, 1.0}) {
      transform->add_matrix(value);
    }
  }
}

Result<Object> object_from_wire(const std::string& path, const v1::Object& object) {
  Object out;
  out.name = object.name();
  LM_RETURN_IF_ERROR(shape_from_wire(path, object, out));
  if (object.has_transform()) {
    LM_ASSIGN_OR_RETURN(out.transform, transform_from_wire(path + ".transform", object.transform()));
  }
  return out;
}

}  // namespace lightmill
