// Conversion of points, colours and asset names between messages and values. Errors begin with the path of the field.
#pragma once

#include <string>

#include "common/scene/document.h"

namespace lightmill::v1 {
class Color;
class Vec3;
}  // namespace lightmill::v1

namespace lightmill {

void to_wire_point(const Point3d& point, v1::Vec3* out);
void to_wire_color(const RgbColor& color, v1::Color* out);

/// `given`: whether the document has the field. It must.
Result<Point3d> point_from_wire(const std::string& path, bool given, const v1::Vec3& point);
/// A colour without a texture.
Result<RgbColor> color_from_wire(const std::string& path, bool given, const v1::Color& color);

/// The asset of a packed document.
Result<Sha256> asset_from_wire(const std::string& path, const std::string& hex);

}  // namespace lightmill
