#include "common/wire/scene_parts.h"

#include "lightmill/v1/scene.pb.h"

namespace lightmill {

void to_wire_point(const Point3d& point, v1::Vec3* out) {
  out->set_x(point[0]);
  out->set_y(point[1]);
  out->set_z(point[2]);
}

void to_wire_color(const RgbColor& color, v1::Color* out) {
  out->mutable_rgb()->set_r(color.r);
  out->mutable_rgb()->set_g(color.g);
  out->mutable_rgb()->set_b(color.b);
}

Result<Point3d> point_from_wire(const std::string& path, bool given, const v1::Vec3& point) {
  if (!given) {
    return invalid_argument("{}: must be given", path);
  }
  return Point3d{point.x(), point.y(), point.z()};
}

Result<RgbColor> color_from_wire(const std::string& path, bool given, const v1::Color& color) {
  if (!given) {
    return invalid_argument("{}: must be given", path);
  }
  if (!color.texture().empty()) {
    return invalid_argument("{}.texture: only reflectances and emission can have a texture: give only rgb", path);
  }
  if (color.kind_case() != v1::Color::kRgb) {
    return invalid_argument("{}: a colour is expected, as in {{\"rgb\": [0.5, 0.5, 0.5]}}", path);
  }
  return RgbColor{color.rgb().r(), color.rgb().g(), color.rgb().b()};
}

Result<Sha256> asset_from_wire(const std::string& path, const std::string& hex) {
  return with_context(Sha256::from_hex(hex), path);
}

}  // namespace lightmill
